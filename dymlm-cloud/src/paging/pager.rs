use std::collections::VecDeque;
use std::io::Result;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;

use super::{PageFile, PageOut};
use crate::CloudMap;
use crate::block_store::BlockKey;
use crate::verdicts::SharedKept;

/// Frames between two counts of the memory, each of which visits all blocks.
const INTERVAL: u32 = 16;
/// Frames after a count in which blocks go. Only then is the rest judged, since what is judged is a clone, which
/// would hold the blocks that go. With more frames, less is left for judging before the next count waits for it;
/// with fewer, each of them writes more. What has been seen since stays in memory.
const PAGING: u32 = 4;
/// One in so many bytes is what the allocator adds for its own numbers and by rounding up: with 487 MB counted, 510
/// were in use.
const ALLOCATOR: usize = 20;
/// Blocks that are judged at a time: a quarter of what a query takes, so that its buffers take some 15 MB less, and
/// a seventh more time, for which nobody waits.
const JUDGED: usize = 1 << 12;

/// Keeps a cloud map within a memory budget: blocks that no frame has seen for longest go to a file, and come
/// back when a frame or a query reaches them. The map is the same, to the bit.
#[derive(Debug)]
pub struct CloudPager {
    file: Arc<PageFile>,
    buffer: Vec<u8>,
    /// Frames since the memory was counted last.
    frames: u32,
    /// The static cloud of the map at the last count, if the map was nearly too large then: a block that is
    /// judged before it goes need not come back for that. It is judged on a thread of its own, so that no frame
    /// waits.
    judging: Option<Judging>,
    /// Blocks of the evidence that are to go, with all voxels in them, in this order.
    due: VecDeque<BlockKey>,
    /// The revision of the evidence up to which these blocks were judged.
    judged: u32,
    /// Bytes of the map when it had been judged.
    bytes: usize,
    /// Bytes that its static cloud took then, beside the one before: both are there while it is judged.
    judging_bytes: usize,
    /// Bytes of the map at the last count, without the blocks that were chosen to go then, and how many it had
    /// got until that count since the one before.
    left: usize,
    growth: usize,
    /// Whether the map is large enough to be judged.
    is_large: bool,
}

#[derive(Debug)]
struct Judging {
    /// The revision of the evidence that is judged.
    revision: u32,
    kept: JoinHandle<SharedKept>,
}

impl CloudPager {
    /// A pager whose file is in a folder that exists. The file has no name where the system allows that, and
    /// is deleted when neither the pager nor a map needs it any more.
    ///
    /// # Errors
    ///
    /// Those of making a file there.
    pub fn new(folder: &Path) -> Result<Self> {
        let file = PageFile::create_in(folder)?;
        Ok(Self {
            file,
            buffer: Vec::new(),
            frames: 0,
            judging: None,
            due: VecDeque::new(),
            judged: 0,
            bytes: 0,
            judging_bytes: 0,
            left: 0,
            growth: 0,
            is_large: false,
        })
    }

    /// Pages out some blocks when the map is about to take more than `budget` bytes of memory. Call it once a
    /// frame, with one map. What the last 12 frames have seen stays in memory, whatever the budget. Each 16th call
    /// visits all blocks.
    ///
    /// # Errors
    ///
    /// Those of writing, on a full disk, for example: then the map stays whole, in memory. Those of reading:
    /// then blocks are lost, and each further call fails.
    pub fn page_out(&mut self, map: &mut CloudMap, budget: impl FnOnce() -> usize) -> Result<()> {
        if let Some(failure) = self.file.failure() {
            return Err(failure);
        }
        self.frames += 1;
        if self.frames >= INTERVAL {
            self.frames = 0;
            self.count(map, budget());
        }
        if self.frames == PAGING && self.is_large {
            self.judge(map);
        }
        // As many a frame that none is left when the map is judged.
        let frames = PAGING.saturating_sub(self.frames).max(1);
        for _ in 0..self.due.len().div_ceil(frames as usize) {
            let Some(&key) = self.due.front() else { break };
            map.page_out(key, self.judged, &self.file, &mut self.buffer)?;
            self.due.pop_front();
        }
        Ok(())
    }

    /// Chooses the blocks to go among those judged since the last count, so many that the map will not be too
    /// large at the next one.
    fn count(&mut self, map: &mut CloudMap, budget: usize) {
        let judged = self.judging.take();
        let judged = judged.and_then(|judging| Some((judging.revision, judging.kept.join().ok()?)));
        let is_judged = judged.is_some();
        if let Some((revision, mut kept)) = judged {
            self.judged = revision;
            kept.page_out_like(&map.kept);
            // What the first judging makes is the static cloud itself, which the map counts from now on.
            let is_first = map.kept.stamp() == 0;
            self.judging_bytes = if is_first { 0 } else { kept.memory_bytes_beside(Some(&map.kept)) };
            map.kept.adopt(&kept);
        }
        // Judging will take about as much again as the last time: the new static cloud beside the one before, and
        // about as much for buffers and for blocks that a frame changes meanwhile, whose clones are judged.
        let bytes = map.memory_bytes() + 2 * self.judging_bytes;
        let bytes = bytes + bytes / ALLOCATOR;
        // The map will grow as it did until now; the last two times, since a camera that turns sees more.
        let latest = bytes.saturating_sub(self.left);
        let growth = latest.max(std::mem::replace(&mut self.growth, latest));
        let excess = (bytes + growth).saturating_sub(budget);
        self.left = bytes;
        self.due.clear();
        if is_judged {
            self.bytes = bytes;
            if excess > 0 {
                self.left -= self.choose(map, excess).min(bytes);
            }
        }
        // Blocks can go at the next count only if they are judged before. And judging what is new takes about as
        // much memory again: a map that was first judged when it had reached the budget would take one and a
        // half times as much.
        let growth = (2 * growth).max(bytes.saturating_sub(self.bytes));
        self.is_large = bytes + growth > budget;
    }

    /// Has the map judged on another thread.
    fn judge(&mut self, map: &CloudMap) {
        let clone = map.clone();
        let judge = move || {
            clone.kept_cloud_by(JUDGED);
            // The clone's blocks are dropped now, not at the next count.
            let CloudMap { kept, .. } = clone;
            kept
        };
        let thread = std::thread::Builder::new().name("dymlm-pager".to_owned()).spawn(judge);
        // Without a thread nothing is paged out.
        self.judging = thread.ok().map(|kept| Judging { revision: map.evidence.revision(), kept });
    }

    /// Chooses blocks that free `bytes` bytes, among those that have not changed since they were judged; returns
    /// how many bytes they free.
    fn choose(&mut self, map: &CloudMap, bytes: usize) -> usize {
        let store = map.evidence.blocks();
        let blocks = store.keys().iter().enumerate().map(|(slot, &key)| (store.stamps().of(slot), key));
        let mut blocks: Vec<(u32, BlockKey)> = blocks.filter(|(stamp, _)| *stamp <= self.judged).collect();
        blocks.sort_unstable();
        let mut gone = 0;
        for (_, key) in blocks {
            if gone > bytes {
                break;
            }
            let own = map.bytes_within(key);
            if own > 0 {
                gone += own;
                self.due.push_back(key);
            }
        }
        gone
    }
}

impl CloudMap {
    /// Frees the memory of blocks that a later state of this map has paged out, as far as the two share them.
    pub fn page_out_like(&mut self, later: &Self) {
        self.voxels.page_out_like(&later.voxels);
        self.evidence.page_out_like(&later.evidence);
        self.kept.page_out_like(&later.kept);
    }

    /// Pages out a block of the evidence, with the voxels in it and what is known of them, unless the block
    /// has changed after `revision`.
    fn page_out(
        &mut self,
        key: BlockKey,
        revision: u32,
        file: &Arc<PageFile>,
        buffer: &mut Vec<u8>,
    ) -> Result<()> {
        let Some(slot) = self.evidence.blocks().slot(key) else { return Ok(()) };
        if self.evidence.blocks().stamps().of(slot) > revision {
            return Ok(());
        }
        let voxels = self.voxel_slots_within(key);
        let mut written = VecDeque::new();
        buffer.clear();
        self.for_each_within(slot, &voxels, |block| written.push_back(block.write(buffer)));
        let extent = Arc::new(file.write(buffer)?);
        self.for_each_within(slot, &voxels, |block| {
            block.leave_memory(&extent, written.pop_front().flatten());
        });
        Ok(())
    }

    /// Calls `visit` with a block of the evidence, the verdicts on it, some blocks of voxels and their static
    /// points.
    fn for_each_within(&mut self, slot: usize, voxels: &[usize], mut visit: impl FnMut(&mut dyn PageOut)) {
        if let Some(block) = self.evidence.paged_mut(slot) {
            visit(block);
        }
        for &slot in voxels {
            if let Some(block) = self.voxels.paged_mut(slot) {
                visit(block);
            }
        }
        self.kept.for_each_within(slot, voxels, visit);
    }

    /// Bytes that [`page_out`](Self::page_out) would free.
    fn bytes_within(&self, key: BlockKey) -> usize {
        let evidence =
            self.evidence.blocks().slot(key).and_then(|slot| self.evidence.blocks().blocks().get(slot));
        let evidence = evidence
            .and_then(|block| block.in_memory())
            .map_or(0, |block| size_of_val(block) + block.memory_bytes());
        let voxels =
            self.voxel_slots_within(key).into_iter().filter_map(|slot| self.voxels.blocks().get(slot));
        let voxels = voxels.filter_map(|block| block.in_memory());
        // The static points and the verdicts take about as much again for each voxel.
        let voxels: usize = voxels.map(|block| size_of_val(block) + 2 * block.memory_bytes()).sum();
        evidence + voxels
    }

    fn voxel_slots_within(&self, key: BlockKey) -> Vec<usize> {
        let mut slots = Vec::new();
        let (first, side) = self.evidence.voxel_blocks_over(key);
        self.voxels.slots_within(first, side, |slot| slots.push(slot));
        slots
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};

    use super::*;
    use crate::CloudMapConfig;

    #[test]
    fn a_map_is_judged_before_it_has_reached_its_budget() {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        let mut pager = CloudPager::new(&std::env::temp_dir()).unwrap();
        let camera = PinholeCamera::new(32, 24, 26.0, 26.0, 15.5, 11.5).unwrap();
        let depth = DepthImage::new(32, 24, vec![1.5; 32 * 24]).unwrap();
        let budget = 10_000_000;
        for step in 0.. {
            let frame = Frame::new(f64::from(step), camera, depth.clone(), None).unwrap();
            let pose = Pose::new([0.05 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
            map.insert(&frame, None, &pose).unwrap();
            pager.page_out(&mut map, || budget).unwrap();
            if map.memory_bytes() > budget {
                break;
            }
        }
        assert!(map.kept.stamp() > 0);
    }
}

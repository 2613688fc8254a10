use std::collections::VecDeque;
use std::io::Result;
use std::path::Path;
use std::sync::Arc;

use super::memory_count::MemoryCount;
use super::{PageFile, PageOut};
use crate::CloudMap;
use crate::block_store::BlockKey;

/// Frames between two choices of the blocks that go. In each of them as many are written, so that no frame
/// waits for many.
const INTERVAL: u32 = 16;
/// What has been seen in so many frames before blocks are chosen stays in memory.
const RECENT: u32 = 12;
/// Most blocks in the file that are looked into at a time, each 16th frame.
const MOST_LOOKS: usize = 4096;
/// One in so many bytes is what the allocator adds for its own numbers and by rounding up: with 487 MB
/// counted, 510 were in use.
const ALLOCATOR: usize = 20;

/// Keeps a cloud map within a memory budget: blocks that no frame has seen for longest go to a file, and come
/// back when a frame or a query reaches them. The map is the same, to the bit.
///
/// A block goes as it is, whether the static cloud has taken in its last changes or not: that costs as much
/// later as before, and nothing when nobody asks. Who then asks for the static cloud of a map whose blocks
/// are mostly in the file has it worked out in batches, which leave them there.
#[derive(Debug)]
pub struct CloudPager {
    file: Arc<PageFile>,
    buffer: Vec<u8>,
    /// Frames since blocks were chosen last.
    frames: u32,
    count: MemoryCount,
    /// Blocks of the evidence that are to go, with all voxels in them, in this order.
    due: VecDeque<BlockKey>,
    /// The slot from which on blocks in the file are looked into next.
    next_look: usize,
    /// The revision of the evidence after which blocks stay in memory.
    settled: u32,
    /// The revisions [`RECENT`] frames before blocks were chosen last, and before they are chosen next.
    aged: [u32; 2],
    /// Bytes of the map when blocks were chosen last, without these blocks, and how many it had got until
    /// then since the time before.
    left: usize,
    growth: usize,
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
            count: MemoryCount::default(),
            due: VecDeque::new(),
            next_look: 0,
            settled: 0,
            aged: [0; 2],
            left: 0,
            growth: 0,
        })
    }

    /// The file of this pager. A map that has been paged out before keeps its [own](CloudMap::page_file).
    pub fn file(&self) -> &Arc<PageFile> {
        &self.file
    }

    /// Pages out some blocks when the map is about to take more than `budget` bytes of memory. Call it once a
    /// frame, with one map. What the last 12 frames have seen stays in memory, whatever the budget. `budget`
    /// is asked in each 16th call.
    ///
    /// # Errors
    ///
    /// Those of writing, on a full disk, for example: then the map stays whole, in memory. Those of reading:
    /// then blocks are lost, and each further call fails.
    pub fn page_out(&mut self, map: &mut CloudMap, budget: impl FnOnce() -> usize) -> Result<()> {
        let file = self.file_of(map);
        if let Some(failure) = file.failure() {
            return Err(failure);
        }
        self.frames += 1;
        self.count.go_on(map, f64::from(self.frames) / f64::from(INTERVAL));
        if self.frames >= INTERVAL {
            self.frames = 0;
            self.choose(map, budget());
        }
        if self.frames == INTERVAL - RECENT {
            self.aged = [self.aged[1], map.evidence.revision()];
        }
        // As many a frame that none is left when blocks are chosen again.
        for _ in 0..self.due.len().div_ceil((INTERVAL - self.frames) as usize) {
            let Some(&key) = self.due.front() else { break };
            map.page_out(key, self.settled, &file, &mut self.buffer)?;
            self.due.pop_front();
        }
        Ok(())
    }

    /// Pages out the blocks of voxels and of the evidence of a map that is being loaded, from these slots on.
    #[cfg(feature = "state")]
    pub(crate) fn page_out_from(&mut self, map: &mut CloudMap, voxels: usize, evidence: usize) -> Result<()> {
        let file = self.file_of(map);
        map.voxels.page_out_from(voxels, &file)?;
        map.evidence.page_out_from(evidence, &file)
    }

    /// The file of a map: that of the first pager that it has met, so that one file tells what the map has lost,
    /// whoever has loaded or corrected it.
    pub(crate) fn file_of(&self, map: &mut CloudMap) -> Arc<PageFile> {
        Arc::clone(map.page_file.get_or_insert_with(|| Arc::clone(&self.file)))
    }

    /// Chooses the blocks to go, so many that the map will not be too large when blocks are chosen again.
    fn choose(&mut self, map: &mut CloudMap, budget: usize) {
        // Verdicts look at blocks that have changed: those that go must have theirs. Mostly somebody has
        // asked for them lately.
        let [earlier, aged] = self.aged;
        if map.kept.judged() < earlier {
            drop(map.verdicts());
        }
        self.settled = aged.min(map.kept.judged());
        let bytes = self.count.finish(map);
        let bytes = bytes + bytes / ALLOCATOR;
        // The map will grow as it did until now; the last two times, since a camera that turns sees more.
        let latest = bytes.saturating_sub(self.left);
        let growth = latest.max(std::mem::replace(&mut self.growth, latest));
        let excess = (bytes + growth).saturating_sub(budget);
        self.due.clear();
        self.left = bytes - self.choose_oldest(map, excess).min(bytes);
    }

    /// Chooses blocks that free so many bytes, those first that no frame has seen for longest; returns how
    /// many bytes they free.
    fn choose_oldest(&mut self, map: &CloudMap, excess: usize) -> usize {
        let (store, mut gone) = (map.evidence.blocks(), 0);
        let in_memory = store.blocks().iter().enumerate().filter(|(_, block)| block.in_memory().is_some());
        let stamped = in_memory.map(|(slot, _)| (store.stamps().of(slot), store.keys()[slot], slot));
        let mut oldest: Vec<(u32, BlockKey, usize)> =
            stamped.filter(|(stamp, ..)| *stamp <= self.settled).collect();
        oldest.sort_unstable();
        for (_, _, slot) in oldest {
            if gone >= excess {
                return gone;
            }
            gone += self.choose_block(map, slot);
        }
        gone + self.choose_brought_back(map, excess.saturating_sub(gone))
    }

    /// Chooses blocks in the file of which a query has brought back something, until they free so many bytes.
    /// They go only when the others do not suffice: finding them means looking into each block, so that it
    /// goes on from where it stopped the last time.
    fn choose_brought_back(&mut self, map: &CloudMap, excess: usize) -> usize {
        let (store, mut gone, mut looks) = (map.evidence.blocks(), 0, 0);
        let all = store.blocks().len();
        let first = if self.next_look < all { self.next_look } else { 0 };
        for slot in (first..all).chain(0..first) {
            if gone >= excess || looks >= MOST_LOOKS {
                self.next_look = slot;
                break;
            }
            if store.blocks()[slot].in_memory().is_none() && store.stamps().of(slot) <= self.settled {
                looks += 1;
                gone += self.choose_block(map, slot);
            }
        }
        gone
    }

    /// Chooses a block, if that frees memory; returns how many bytes.
    fn choose_block(&mut self, map: &CloudMap, slot: usize) -> usize {
        let key = map.evidence.blocks().keys()[slot];
        let own = map.block_bytes([slot], map.voxel_slots_within(key));
        if own > 0 {
            self.due.push_back(key);
        }
        own
    }
}

impl CloudMap {
    /// The file in which a [`CloudPager`] has put blocks; `None` as long as the map has met no pager. Blocks are
    /// lost when it [has failed](PageFile::failure).
    pub fn page_file(&self) -> Option<&Arc<PageFile>> {
        self.page_file.as_ref()
    }

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
    use crate::{CloudMapConfig, Selection};

    /// A walk along a wall, with `after` called when the map and its pager have taken in a frame.
    fn walk(frames: u32, budget: usize, mut after: impl FnMut(&mut CloudMap, &CloudPager)) -> CloudMap {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        let mut pager = CloudPager::new(&std::env::temp_dir()).unwrap();
        let camera = PinholeCamera::new(32, 24, 26.0, 26.0, 15.5, 11.5).unwrap();
        let depth = DepthImage::new(32, 24, vec![1.5; 32 * 24]).unwrap();
        for step in 0..frames {
            let frame = Frame::new(f64::from(step), camera, depth.clone(), None).unwrap();
            let pose = Pose::new([0.05 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
            map.insert(&frame, None, &pose).unwrap();
            pager.page_out(&mut map, || budget).unwrap();
            after(&mut map, &pager);
        }
        map
    }

    #[test]
    fn what_is_counted_a_part_a_frame_is_what_a_count_of_all_gives() {
        let map = walk(60, 1_000_000, |map, _| _ = map.len());
        let mut count = MemoryCount::default();
        for share in [0.1, 0.4, 0.7, 1.0] {
            count.go_on(&map, share);
        }
        assert_eq!(count.finish(&map), map.memory_bytes());
    }

    #[test]
    fn all_that_a_map_pages_out_is_in_one_file() {
        let mut other = CloudPager::new(&std::env::temp_dir()).unwrap();
        let map = walk(400, 2_000_000, |map, _| other.page_out(map, || 2_000_000).unwrap());
        assert!(map.page_file().is_some_and(|file| !Arc::ptr_eq(file, other.file())));
        assert_eq!(Arc::strong_count(other.file()), 1, "no block is in it");
    }

    #[test]
    fn a_frame_writes_its_part_of_what_goes() {
        let (mut most, mut all, mut before) = (0, 0, 0);
        walk(400, 2_000_000, |_, pager| {
            let gone = usize::saturating_sub(before, pager.due.len());
            (before, all) = (pager.due.len(), all + gone);
            most = most.max(gone);
        });
        assert!(all > 500 && most * 50 < all, "{most} of {all} in one frame");
    }

    #[test]
    fn blocks_go_whether_the_static_cloud_has_taken_them_in_or_not() {
        let unread = walk(400, 2_000_000, |_, _| ());
        let read = walk(400, 2_000_000, |map, _| _ = map.len());
        let whole = walk(400, usize::MAX, |_, _| ());
        assert!(unread.memory_bytes() < 3_000_000, "{}", unread.memory_bytes());
        assert!(read.memory_bytes() < 3_000_000, "{}", read.memory_bytes());
        let cloud = whole.point_cloud(Selection::Static);
        assert!(
            unread.point_cloud(Selection::Static) == cloud && read.point_cloud(Selection::Static) == cloud
        );
        assert!(unread.memory_bytes() < 4_000_000, "reading it leaves it in the file");
        assert!(whole.memory_bytes() > 10_000_000, "{}", whole.memory_bytes());
    }
}

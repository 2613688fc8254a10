use std::collections::BTreeMap;
#[cfg(feature = "state")]
use std::sync::Arc;

use dymlm_core::{DepthImage, PinholeCamera, Pose, SensorModel};

use crate::block_store::{
    BLOCK_CELLS, BLOCK_SIDE, BlockKey, BlockStore, CellBits, Retained, has, put, split, without,
};
use crate::direction::Direction;
use crate::epochs::{Epochs, epoch_of};
use crate::finding::Finding;
use crate::frame_reads::{BlockReads, FrameReads};
use crate::look_through::{LookThrough, LookedThrough};
use crate::opinion::Opinion;
#[cfg(feature = "state")]
use crate::paging::PageFile;
use crate::paging::{Look, Paged, record};
use crate::place_history::{PlaceHistory, PlacePeriod};
use crate::scan::{Scan, ScanRays};
use crate::support::Support;

/// Side of a cell, metres; rounded to the nearest power of two of voxels, at least one. Smaller cells may be
/// missed by the one reading at their centre, larger ones hold both a surface and the free space before it.
const CELL_SIZE: f64 = 0.04;
/// The latest epoch of a map without frames.
const NO_EPOCH: i32 = i32::MIN;

/// Counts, by [periods](Epochs) of time, for and against each place being static: the frames that have read a
/// surface there, those that have read a mover, and those that have looked through it.
///
/// Counts are integers, and each frame adds at most one finding to each cell, where a surface wins over a
/// mover and both win over a look through ([`LookThrough`]). So the evidence does not depend on the order of
/// the frames, and a frame can be taken out again.
///
/// The idea is that of Dynablox (Schmid 2023) and DUFOMap (Duberg 2024): movers are recognized because their
/// place has been free before. Counts take the place of their clocks. From Khronos (Schmid 2024) comes that
/// what is known to be a mover is no surface, however long it stays.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    /// A cell has 2^`cell_shift` voxels along its side.
    cell_shift: u32,
    look_through: LookThrough,
    /// The cells that the rays of the last scan passed.
    rays: ScanRays,
    blocks: BlockStore<EvidenceBlock>,
    /// The epoch of the current frame, which may be an older one.
    epoch: i32,
    /// The latest epoch of all frames: what is present is what was seen in it.
    newest: i32,
    /// Number of changes so far.
    revision: u32,
    reads: FrameReads,
    /// Whether the current frame has taken out more than was put in.
    is_overdrawn: bool,
}

/// How cells divide a block of voxels; the block may also be a part of one cell.
struct CellsInBlock {
    /// Cells along the side of the block.
    count: usize,
    /// Voxels of the block along the side of a cell.
    side: usize,
    /// The voxels of the first cell in a layer, which is a word of eight rows.
    square: u64,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct EvidenceBlock {
    epochs: Epochs,
}

record!(EvidenceBlock { epochs });

impl Evidence {
    pub(crate) fn new(voxel_size: f64, sensor: SensorModel) -> Self {
        let cell_shift = (CELL_SIZE / voxel_size).log2().round().clamp(0.0, 10.0) as u32;
        Self {
            cell_shift,
            look_through: LookThrough::new(voxel_size * f64::from(1_u32 << cell_shift), sensor),
            rays: ScanRays::default(),
            blocks: BlockStore::default(),
            epoch: NO_EPOCH,
            newest: NO_EPOCH,
            revision: 0,
            reads: FrameReads::default(),
            is_overdrawn: false,
        }
    }

    /// Side of a cell, metres.
    pub(crate) fn cell_size(&self) -> f64 {
        self.look_through.cell_size()
    }

    /// Begins the frame of a time.
    pub(crate) fn begin_frame(&mut self, timestamp: f64) {
        self.epoch = epoch_of(timestamp);
        self.newest = self.newest.max(self.epoch);
        self.revision += 1;
    }

    /// The number of the last change.
    pub(crate) fn revision(&self) -> u32 {
        self.revision
    }

    /// The latest epoch of all frames.
    pub(crate) fn newest(&self) -> i32 {
        self.newest
    }

    /// Goes back to a latest epoch, after a frame was taken out.
    pub(crate) fn set_newest(&mut self, newest: i32) {
        self.newest = newest;
    }

    /// Goes on from a saved latest epoch and revision.
    #[cfg(feature = "state")]
    pub(crate) fn restore(&mut self, newest: i32, revision: u32) {
        (self.newest, self.revision) = (newest, revision);
    }

    /// Puts a block where there is none.
    #[cfg(feature = "state")]
    pub(crate) fn put_block(&mut self, key: BlockKey, epochs: Epochs, revision: u32) {
        let slot = self.blocks.put(key, EvidenceBlock { epochs });
        self.blocks.stamps_mut().note(slot, revision);
    }

    /// Notes that the current frame has read a surface in `voxel`.
    #[inline]
    pub(crate) fn read(&mut self, voxel: [i32; 3]) {
        self.note(voxel, |block| &mut block.surfaces);
    }

    /// Notes that the current frame has read surfaces in these voxels of a block of voxels.
    pub(crate) fn read_voxels(&mut self, voxels: BlockKey, read: &CellBits) {
        let (block, first) = self.cell_of(voxels.cell(0));
        let CellsInBlock { count, side, square } = self.cells_in_block();
        let key = BlockKey::new(block);
        let surfaces = &mut self.reads.of_block(key, || self.blocks.slot_or_insert(key)).surfaces;
        for z in 0..count {
            let layer = read[z * side..(z + 1) * side].iter().fold(0, |layer, word| layer | word);
            for (x, y) in (0..count).flat_map(|y| (0..count).map(move |x| (x, y))) {
                if layer & square << (side * (BLOCK_SIDE * y + x)) != 0 {
                    put(surfaces, first + (z << 6 | y << 3 | x));
                }
            }
        }
    }

    /// Notes that the current frame has read a mover in `voxel`.
    #[inline]
    pub(crate) fn read_mover(&mut self, voxel: [i32; 3]) {
        self.note(voxel, |block| &mut block.movers);
    }

    #[inline]
    fn note(&mut self, voxel: [i32; 3], cells: impl Fn(&mut BlockReads) -> &mut CellBits) {
        let (block, index) = self.cell_of(voxel);
        let key = BlockKey::new(block);
        put(cells(self.reads.of_block(key, || self.blocks.slot_or_insert(key))), index);
    }

    /// Counts the frame whose readings have been noted: what it looks through, then what it has read.
    pub(crate) fn count_frame(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        world_from_camera: &Pose,
        direction: Direction,
    ) {
        self.is_overdrawn = false;
        self.look_through.take_view(camera, depth, world_from_camera);
        self.count_looked_through(depth, direction);
        self.count_readings(direction);
    }

    /// The same for a scan, whose rays are followed.
    pub(crate) fn count_scan(&mut self, scan: Scan<'_>, direction: Direction) {
        self.is_overdrawn = false;
        let mut rays = std::mem::take(&mut self.rays);
        rays.follow(scan, &self.look_through);
        for (key, cells) in rays.blocks() {
            let slot = self.blocks.slot_or_insert(key);
            self.blocks.stamps_mut().note(slot, self.revision);
            let Some(block) = self.blocks.block_mut(slot) else { continue };
            let looked_through = LookedThrough::Cells(cells);
            self.is_overdrawn |=
                block.count_looked_through(looked_through, self.reads.at(slot), self.epoch, direction);
        }
        self.rays = rays;
        self.count_readings(direction);
    }

    /// Block coordinates and index in its block of the cell that holds a voxel.
    #[inline]
    pub(crate) fn cell_of(&self, voxel: [i32; 3]) -> ([i32; 3], usize) {
        split(self.cell_at(voxel))
    }

    /// The cell that holds a voxel.
    #[inline]
    pub(crate) fn cell_at(&self, voxel: [i32; 3]) -> [i32; 3] {
        voxel.map(|c| c >> self.cell_shift)
    }

    /// What the counts of a cell from before the newest epoch say, or those of the newest one when there
    /// are no others; `None` when nothing was ever seen of the block around it.
    pub(crate) fn settled_opinion(&self, cell: [i32; 3], looks_per_reading: f32) -> Option<Opinion> {
        let (block, index) = split(cell);
        let block = self.blocks.get(BlockKey::new(block))?;
        Some(self.settled_opinion_in(block, index, looks_per_reading))
    }

    /// The same for a cell of this block, by its index.
    pub(crate) fn settled_opinion_in(
        &self,
        block: &EvidenceBlock,
        index: usize,
        looks_per_reading: f32,
    ) -> Opinion {
        Opinion::of(block.epochs.settled(index, self.newest), looks_per_reading)
    }

    /// Whether any frame has looked through the cell of a voxel.
    pub(crate) fn is_looked_through(&self, voxel: [i32; 3]) -> bool {
        let (block, index) = self.cell_of(voxel);
        let block = self.blocks.get(BlockKey::new(block));
        block.is_some_and(|block| block.epochs.of_cell(index).any(|(_, counts)| counts.looked_through > 0))
    }

    /// The slot of the block that holds the cell of a voxel.
    pub(crate) fn slot_of(&self, voxel: [i32; 3]) -> Option<usize> {
        self.blocks.slot(BlockKey::new(self.cell_of(voxel).0))
    }

    /// The voxels of a block of voxels that lie in these cells of the evidence's block around it.
    pub(crate) fn voxels_in(&self, cells: &CellBits, voxels: BlockKey) -> CellBits {
        let (_, first) = self.cell_of(voxels.cell(0));
        let CellsInBlock { count, side, square } = self.cells_in_block();
        let mut inside = CellBits::default();
        for z in 0..count {
            let in_layer = (0..count).flat_map(|y| (0..count).map(move |x| (y, x)));
            let in_layer = in_layer.filter(|(y, x)| has(cells, first + (z << 6 | y << 3 | x)));
            let layer = in_layer.fold(0, |layer, (y, x)| layer | square << (side * (BLOCK_SIDE * y + x)));
            inside[z * side..(z + 1) * side].fill(layer);
        }
        inside
    }

    fn cells_in_block(&self) -> CellsInBlock {
        let (count, side) = (BLOCK_SIDE >> self.cell_shift.min(3), 1 << self.cell_shift.min(3));
        let row = 0xFF >> (BLOCK_SIDE - side);
        let square = (0..side).fold(0, |square, y| square | row << (BLOCK_SIDE * y));
        CellsInBlock { count, side, square }
    }

    /// The blocks of voxels in a block of cells: the lowest of them, and how many there are along a side.
    pub(crate) fn voxel_blocks_over(&self, cells: BlockKey) -> ([i32; 3], i32) {
        (cells.block().map(|c| c << self.cell_shift), 1 << self.cell_shift)
    }

    /// The counts of the cell of a voxel, of all frames together.
    pub(crate) fn of_voxel(&self, voxel: [i32; 3]) -> Support {
        let (block, _) = self.cell_of(voxel);
        self.of_voxel_in(self.blocks.get(BlockKey::new(block)), voxel)
    }

    /// The block in which the cell of a voxel is, as are those of all voxels in one block, without bringing
    /// it back to memory.
    pub(crate) fn look_over(&self, voxel: [i32; 3]) -> Option<Look<'_, EvidenceBlock>> {
        let slot = self.slot_of(voxel)?;
        Some(self.blocks.blocks()[slot].look())
    }

    /// [`of_voxel`](Self::of_voxel), where `block` is the voxel's.
    pub(crate) fn of_voxel_in(&self, block: Option<&EvidenceBlock>, voxel: [i32; 3]) -> Support {
        let (_, index) = self.cell_of(voxel);
        block.map_or(Support::default(), |block| block.total(index))
    }

    /// What was seen of the cell of a voxel over time.
    pub(crate) fn history(&self, voxel: [i32; 3], looks_per_reading: f32) -> PlaceHistory {
        let (block, index) = self.cell_of(voxel);
        let block = self.blocks.get(BlockKey::new(block));
        let periods = block.into_iter().flat_map(|block| block.epochs.of_cell(index));
        let seen = periods.filter(|(_, evidence)| *evidence != Support::default());
        let mut periods: Vec<PlacePeriod> = seen
            .map(|(period, evidence)| {
                let [from, to] = period.span();
                let is_occupied = Opinion::of([evidence], looks_per_reading).is_static();
                PlacePeriod { from, to, evidence, is_occupied }
            })
            .collect();
        periods.reverse();
        PlaceHistory { periods }
    }

    /// Whether the counts say that nothing stands in the cell of a voxel.
    pub(crate) fn is_outvoted(&self, voxel: [i32; 3], looks_per_reading: f32) -> bool {
        let (block, index) = self.cell_of(voxel);
        let block = self.blocks.get(BlockKey::new(block));
        block.is_none_or(|block| block.opinion(index, looks_per_reading).presence < 0.0)
    }

    /// Removes the surface readings of some cells of a block: what was read there is gone.
    pub(crate) fn clear_support(&mut self, block: [i32; 3], cells: impl IntoIterator<Item = usize>) {
        let slot = self.blocks.slot(BlockKey::new(block));
        if let Some(block) = slot.and_then(|slot| self.blocks.block_mut(slot)) {
            block.epochs.clear_support(cells);
        }
        self.revision += 1;
        if let Some(slot) = slot {
            self.blocks.stamps_mut().note(slot, self.revision);
        }
    }

    /// Forgets what speaks against some cells of a block, and gives each so many surface readings.
    pub(crate) fn give_support(&mut self, block: [i32; 3], cells: &BTreeMap<usize, u32>) {
        let slot = self.blocks.slot_or_insert(BlockKey::new(block));
        if let Some(block) = self.blocks.block_mut(slot) {
            block.epochs.period_mut(self.newest);
            block.epochs.give_support(cells);
        }
        self.revision += 1;
        self.blocks.stamps_mut().note(slot, self.revision);
    }

    /// Whether the frame counted last has taken out more than was put in.
    pub(crate) fn is_overdrawn(&self) -> bool {
        self.is_overdrawn
    }

    /// The blocks; their stamps are the revisions of their last changes.
    pub(crate) fn blocks(&self) -> &BlockStore<EvidenceBlock> {
        &self.blocks
    }

    /// Adds another map's evidence.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.revision += 1;
        self.newest = self.newest.max(other.newest);
        for (key, theirs) in other.blocks.keys().iter().zip(other.blocks.blocks().iter()) {
            let slot = self.blocks.slot_or_insert(*key);
            if let Some(block) = self.blocks.block_mut(slot) {
                block.epochs.merge(&theirs.look().epochs);
            }
            self.blocks.stamps_mut().note(slot, self.revision);
        }
    }

    /// The blocks that the current frame has changed, and in which no count is left.
    pub(crate) fn void_blocks(&self) -> Vec<BlockKey> {
        let changed = self.blocks.stamps().after(self.revision.saturating_sub(1));
        let void = changed.filter(|&slot| self.blocks.blocks()[slot].look().epochs.is_void());
        void.map(|slot| self.blocks.keys()[slot]).collect()
    }

    /// Forgets the blocks for which `is_forgotten` is true; the blocks around them count as changed.
    pub(crate) fn forget(&mut self, is_forgotten: impl Fn(BlockKey) -> bool) -> Option<Retained> {
        let retained = self.blocks.retain(|key| !is_forgotten(key))?;
        self.reads.clear();
        self.revision += 1;
        for &slot in &retained.around {
            self.blocks.stamps_mut().note(slot, self.revision);
        }
        Some(retained)
    }

    /// Bytes that another state of the evidence does not share.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let (none, owned) = (BlockStore::default(), EvidenceBlock::memory_bytes_beside);
        self.blocks.memory_bytes_beside(other.map_or(&none, |other| &other.blocks), owned)
    }

    /// The same without the blocks.
    pub(crate) fn list_bytes(&self) -> usize {
        self.blocks.list_bytes_beside(&BlockStore::default())
    }

    /// Bytes of memory of a block.
    pub(crate) fn block_bytes(&self, slot: usize) -> usize {
        let block = self.blocks.blocks().get(slot);
        block.map_or(0, |block| block.memory_bytes_beside(None, EvidenceBlock::memory_bytes_beside))
    }

    /// The block of a slot, to page it out.
    pub(crate) fn paged_mut(&mut self, slot: usize) -> Option<&mut Paged<EvidenceBlock>> {
        self.blocks.paged_mut(slot)
    }

    /// Pages out the blocks from a slot on.
    #[cfg(feature = "state")]
    pub(crate) fn page_out_from(&mut self, first: usize, file: &Arc<PageFile>) -> std::io::Result<()> {
        self.blocks.page_out_from(first, file)
    }

    /// Frees the memory of blocks that a clone has paged out.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        self.blocks.page_out_like(&other.blocks);
    }

    fn count_looked_through(&mut self, depth: &DepthImage, direction: Direction) {
        let (blocks, is_overdrawn) = (&mut self.blocks, &mut self.is_overdrawn);
        let (epoch, revision) = (self.epoch, self.revision);
        let reads = &self.reads;
        self.look_through.for_each_block(depth, |place, looked_through| {
            let slot = blocks.slot_or_insert(BlockKey::new(place));
            blocks.stamps_mut().note(slot, revision);
            let Some(block) = blocks.block_mut(slot) else { return };
            *is_overdrawn |= block.count_looked_through(looked_through, reads.at(slot), epoch, direction);
        });
    }

    fn count_readings(&mut self, direction: Direction) {
        for reads in self.reads.iter() {
            self.blocks.stamps_mut().note(reads.slot, self.revision);
            if let Some(block) = self.blocks.block_mut(reads.slot) {
                self.is_overdrawn |= block.count_readings(reads, self.epoch, direction);
            }
        }
        self.reads.clear();
    }
}

impl EvidenceBlock {
    #[cfg(feature = "state")]
    pub(crate) fn epochs(&self) -> &Epochs {
        &self.epochs
    }

    /// Bytes that the block owns and does not share with another.
    fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        self.epochs.memory_bytes_beside(other.map(|other| &other.epochs))
    }

    /// Counts the cells that the current frame has read. Like the next method, returns whether a count is
    /// overdrawn.
    fn count_readings(&mut self, reads: &BlockReads, epoch: i32, direction: Direction) -> bool {
        let movers = without(reads.movers, reads.surfaces);
        self.epochs.count(epoch, |period| {
            period.count_all(&reads.surfaces, Finding::Surface, direction)
                | period.count_all(&movers, Finding::Mover, direction)
        })
    }

    fn count_looked_through(
        &mut self,
        cells: LookedThrough,
        reads: Option<&BlockReads>,
        epoch: i32,
        direction: Direction,
    ) -> bool {
        let cells = match cells {
            LookedThrough::All if reads.is_none() => {
                return self.epochs.count(epoch, |period| period.count_whole(direction));
            }
            LookedThrough::All => [u64::MAX; BLOCK_CELLS / 64],
            LookedThrough::Cells(cells) => cells,
        };
        let cells = reads.map_or(cells, |reads| without(without(cells, reads.surfaces), reads.movers));
        if cells == CellBits::default() {
            return false;
        }
        self.epochs.count(epoch, |period| period.count_all(&cells, Finding::LookedThrough, direction))
    }

    /// What the counts say of the cell with this index.
    pub(crate) fn opinion(&self, index: usize, looks_per_reading: f32) -> Opinion {
        Opinion::of(self.epochs.of_cell(index).map(|(_, counts)| counts), looks_per_reading)
    }

    /// Calls `visit` with what the counts say of each of these cells, by index.
    pub(crate) fn for_each_opinion(
        &self,
        cells: &CellBits,
        looks_per_reading: f32,
        visit: impl FnMut(usize, Opinion),
    ) {
        self.epochs.for_each_opinion(cells, looks_per_reading, visit);
    }

    /// The counts of the cell with this index, of all frames together.
    pub(crate) fn total(&self, index: usize) -> Support {
        self.epochs.of_cell(index).fold(Support::default(), |sum, (_, counts)| Support {
            support: sum.support.saturating_add(counts.support),
            looked_through: sum.looked_through.saturating_add(counts.looked_through),
            movers: sum.movers.saturating_add(counts.movers),
        })
    }

    /// The cells in which a surface or a mover was ever read.
    pub(crate) fn cells_read(&self) -> CellBits {
        self.epochs.cells_read()
    }

    /// Whether a surface or a mover may have been read in the block.
    #[inline]
    pub(crate) fn may_be_read(&self) -> bool {
        self.epochs.has_cells()
    }
}

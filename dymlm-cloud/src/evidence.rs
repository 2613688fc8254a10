use dymlm_core::{DepthImage, PinholeCamera, Pose, SensorModel};

use crate::block_store::{BLOCK_CELLS, BlockKey, BlockStore, CellBits, split};
use crate::look_through::{LookThrough, LookedThrough};

/// Side of a cell, metres; rounded to the nearest power of two of voxels, at least one. Smaller cells are
/// missed by the one reading at their centre, larger ones hold both a surface and the free space before it.
const CELL_SIZE: f64 = 0.04;

/// For and against each place being static: how many frames have read a surface there, and how many have
/// looked through it, over all frames, whether before or after something was mapped there.
///
/// Counts are integers and each frame adds to each cell at most once, a surface winning over a look through
/// ([`LookThrough`]), so the evidence does not depend on the order of the frames, and a frame can be taken
/// out again.
///
/// This is the idea of Dynablox (Schmid 2023) and DUFOMap (Duberg 2024), movers betray themselves by having
/// been in free space, with counts in place of their clocks.
#[derive(Debug, Clone)]
pub(crate) struct Evidence {
    /// A cell has 2^`cell_shift` voxels along its side.
    cell_shift: u32,
    look_through: LookThrough,
    blocks: BlockStore<EvidenceBlock>,
    /// Slots of blocks with a cell read by the current frame.
    read_blocks: Vec<usize>,
    /// The block read last, and its slot.
    last_read: Option<(BlockKey, usize)>,
    /// Whether the current frame has taken out more than was put in.
    is_overdrawn: bool,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct EvidenceBlock {
    /// Frames that look through all of the block; in addition to what the cells count.
    looked_through: u32,
    /// All cells, or none as long as no cell differs from the others.
    cells: Vec<Support>,
    /// The cells that the current frame has read, and whether there are any.
    read: CellBits,
    is_read: bool,
}

/// How many frames speak for and against a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Support {
    /// Frames that read a surface there.
    pub support: u32,
    /// Frames that looked through.
    pub looked_through: u32,
}

/// Whether a frame is put in or taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Insert,
    Remove,
}

impl Direction {
    /// +1 or -1 for wrapping counters.
    #[inline]
    pub(crate) fn unit(self) -> u32 {
        match self {
            Self::Insert => 1,
            Self::Remove => 1_u32.wrapping_neg(),
        }
    }
}

impl Evidence {
    pub(crate) fn new(voxel_size: f64, sensor: SensorModel) -> Self {
        let cell_shift = (CELL_SIZE / voxel_size).log2().round().clamp(0.0, 10.0) as u32;
        Self {
            cell_shift,
            look_through: LookThrough::new(voxel_size * f64::from(1_u32 << cell_shift), sensor),
            blocks: BlockStore::default(),
            read_blocks: Vec::new(),
            last_read: None,
            is_overdrawn: false,
        }
    }

    /// Side of a cell, metres.
    pub(crate) fn cell_size(&self) -> f64 {
        self.look_through.cell_size()
    }

    /// Notes that the current frame has read a surface in `voxel`.
    #[inline]
    pub(crate) fn read(&mut self, voxel: [i32; 3]) {
        let (block, index) = self.cell_of(voxel);
        let key = BlockKey::new(block);
        // Neighbouring readings mostly share a block.
        let slot = match self.last_read {
            Some((last_key, slot)) if last_key == key => slot,
            _ => self.blocks.slot_or_insert(key),
        };
        self.last_read = Some((key, slot));
        if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
            if !block.is_read {
                block.is_read = true;
                self.read_blocks.push(slot);
            }
            block.read[index / 64] |= 1 << (index % 64);
        }
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
        self.count_looked_through(depth, direction.unit());
        self.count_support(direction.unit());
    }

    /// Block coordinates and index in its block of the cell that holds a voxel.
    #[inline]
    pub(crate) fn cell_of(&self, voxel: [i32; 3]) -> ([i32; 3], usize) {
        split(voxel.map(|c| c >> self.cell_shift))
    }

    /// Frames that read the cell of a voxel.
    pub(crate) fn support_of(&self, voxel: [i32; 3]) -> u32 {
        let (block, index) = self.cell_of(voxel);
        self.blocks.get(BlockKey::new(block)).map_or(0, |block| block.at(index).support)
    }

    /// Whether more speaks against the cell of a voxel than for it.
    pub(crate) fn is_outvoted(&self, voxel: [i32; 3], looks_per_reading: f64) -> bool {
        let (block, index) = self.cell_of(voxel);
        let evidence =
            self.blocks.get(BlockKey::new(block)).map_or(Support::default(), |block| block.at(index));
        looks_per_reading * f64::from(evidence.support) < f64::from(evidence.looked_through)
    }

    /// Takes out what speaks for the cell of a voxel: what was read there is gone.
    pub(crate) fn clear_support(&mut self, voxel: [i32; 3]) {
        let (block, index) = self.cell_of(voxel);
        let slot = self.blocks.slot(BlockKey::new(block));
        let block = slot.and_then(|slot| self.blocks.blocks_mut().get_mut(slot));
        if let Some(cell) = block.and_then(|block| block.cells.get_mut(index)) {
            cell.support = 0;
        }
    }

    /// Raises what speaks for the cell of a voxel until `support` of it is left when all that speaks against
    /// it is weighed up.
    pub(crate) fn give_support(&mut self, voxel: [i32; 3], support: u32, looks_per_reading: f64) {
        let (block, index) = self.cell_of(voxel);
        let slot = self.blocks.slot_or_insert(BlockKey::new(block));
        if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
            let against = (f64::from(block.at(index).looked_through) / looks_per_reading).ceil() as u32;
            if let Some(cell) = block.cells_mut().get_mut(index) {
                cell.support = cell.support.max(against.saturating_add(support.max(1)));
            }
        }
    }

    /// Whether the frame counted last has taken out more than was put in.
    pub(crate) fn is_overdrawn(&self) -> bool {
        self.is_overdrawn
    }

    pub(crate) fn blocks(&self) -> &BlockStore<EvidenceBlock> {
        &self.blocks
    }

    /// Adds another map's evidence.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (key, theirs) in other.blocks.keys().iter().zip(other.blocks.blocks()) {
            let slot = self.blocks.slot_or_insert(*key);
            if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
                block.looked_through = block.looked_through.wrapping_add(theirs.looked_through);
                for (index, cell) in theirs.cells.iter().enumerate() {
                    let ours = &mut block.cells_mut()[index];
                    ours.support = ours.support.wrapping_add(cell.support);
                    ours.looked_through = ours.looked_through.wrapping_add(cell.looked_through);
                }
            }
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let cells: usize = self.blocks.blocks().iter().map(|block| block.cells.capacity()).sum();
        self.blocks.memory_bytes() + cells * size_of::<Support>()
    }

    fn count_looked_through(&mut self, depth: &DepthImage, unit: u32) {
        let (blocks, is_overdrawn) = (&mut self.blocks, &mut self.is_overdrawn);
        self.look_through.for_each_block(depth, |place, looked_through| {
            let key = BlockKey::new(place);
            let read = blocks.get(key).filter(|block| block.is_read).map(|block| block.read);
            let slot = blocks.slot_or_insert(key);
            let Some(block) = blocks.blocks_mut().get_mut(slot) else { return };
            *is_overdrawn |= match (looked_through, read) {
                (LookedThrough::All, None) => count(&mut block.looked_through, unit),
                (LookedThrough::All, Some(read)) => block.count_looked_through(read.map(|word| !word), unit),
                (LookedThrough::Cells(cells), read) => {
                    let read = read.unwrap_or_default();
                    block.count_looked_through(std::array::from_fn(|word| cells[word] & !read[word]), unit)
                }
            };
        });
    }

    fn count_support(&mut self, unit: u32) {
        for slot in self.read_blocks.drain(..) {
            if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
                self.is_overdrawn |= block.count_read(unit);
            }
        }
    }
}

impl EvidenceBlock {
    fn cells_mut(&mut self) -> &mut [Support] {
        if self.cells.is_empty() {
            self.cells = vec![Support::default(); BLOCK_CELLS];
        }
        &mut self.cells
    }

    /// Counts the cells that the current frame has read, and forgets which they were. Like the next, tells
    /// whether a count is overdrawn.
    fn count_read(&mut self, unit: u32) -> bool {
        let read = std::mem::take(&mut self.read);
        self.is_read = false;
        let cells = self.cells_mut();
        any_bit(read, |index| count(&mut cells[index].support, unit))
    }

    fn count_looked_through(&mut self, looked_through: CellBits, unit: u32) -> bool {
        if looked_through == CellBits::default() {
            return false;
        }
        let cells = self.cells_mut();
        any_bit(looked_through, |index| count(&mut cells[index].looked_through, unit))
    }

    /// The evidence of the cell with this index.
    #[inline]
    pub(crate) fn at(&self, index: usize) -> Support {
        let cell = self.cells.get(index).copied().unwrap_or_default();
        Support { looked_through: cell.looked_through.wrapping_add(self.looked_through), ..cell }
    }

    /// Whether a surface may have been read in it.
    #[inline]
    pub(crate) fn may_be_supported(&self) -> bool {
        !self.cells.is_empty()
    }
}

/// Adds +1 or -1; tells whether more was taken out than put in.
#[inline]
fn count(counter: &mut u32, unit: u32) -> bool {
    *counter = counter.wrapping_add(unit);
    *counter > u32::MAX / 2
}

/// Calls `count` for each bit, all of them; tells whether any call said so.
fn any_bit(cells: CellBits, mut count: impl FnMut(usize) -> bool) -> bool {
    let mut any = false;
    for (word, mut bits) in cells.into_iter().enumerate() {
        while bits != 0 {
            any |= count(word * 64 + bits.trailing_zeros() as usize);
            bits &= bits - 1;
        }
    }
    any
}

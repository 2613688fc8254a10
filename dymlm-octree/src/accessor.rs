use crate::lattice::{Key, Lattice, pack};
use crate::occupancy_model::OccupancyModel;
use crate::storage::{Entry, Tree};
use crate::{CellState, Octree};

/// A reader that remembers where it last looked: queries near each other cost a few nanoseconds.
///
/// ```
/// use dymlm_octree::{CellState, Octree, OctreeConfig};
///
/// let mut map = Octree::new(OctreeConfig::default())?;
/// map.insert_scan([0.0; 3], &[[1.0, 0.0, 0.0]])?;
/// let mut accessor = map.accessor();
/// let free = (0..40).filter(|&i| accessor.state([f64::from(i) * 0.025, 0.0, 0.0]) == CellState::Free).count();
/// assert_eq!(free, 40);
/// # Ok::<(), dymlm_octree::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Accessor<'a> {
    pub(crate) lattice: Lattice,
    tree: &'a Tree,
    /// A cell of the block that was queried last, as one integer.
    last: u64,
    /// The tree's entry for the cube of 64^3 cells around it.
    in_region: &'a Entry,
    /// The tree's entry for the cube of 8^3 cells around it, its block.
    in_block: &'a Entry,
}

/// The bits of a key that tell apart blocks: all but the lowest three of each index.
const OTHER_BLOCK: u64 = 0xFFF8_FFF8_FFF8;
/// The bits of a key that tell apart cubes of 64^3 cells.
const OTHER_REGION: u64 = 0xFFC0_FFC0_FFC0;

impl Octree {
    /// A reader for many queries in one neighbourhood.
    pub fn accessor(&self) -> Accessor<'_> {
        let (key, tree) = ([0; 3], &self.tree);
        let in_region = tree.entry(key, 2);
        let in_block = in_region.below(key);
        Accessor { lattice: self.lattice, tree, last: pack(key), in_region, in_block }
    }
}

impl Accessor<'_> {
    /// [`Octree::state`].
    #[inline]
    pub fn state(&mut self, point: [f64; 3]) -> CellState {
        let log_odds = self.log_odds(point);
        OccupancyModel::state(log_odds)
    }

    /// [`Octree::log_odds`].
    #[inline]
    pub fn log_odds(&mut self, point: [f64; 3]) -> Option<f32> {
        let key = self.lattice.key(point)?;
        self.cell(key)
    }

    /// The log-odds of a cell.
    #[inline]
    pub(crate) fn cell(&mut self, key: Key) -> Option<f32> {
        if (pack(key) ^ self.last) & OTHER_BLOCK != 0 {
            self.find_block(key);
        }
        self.in_block.log_odds(key)
    }

    /// log2 of the side, in cells, of a cube around the cell queried last that is equal throughout: 0 for a
    /// single cell, else 3 or more.
    #[inline]
    pub(crate) fn side_bits(&self, key: Key) -> u32 {
        match (self.in_block, self.in_region) {
            (Entry::Block(_), _) => 0,
            (_, Entry::Branch(_)) => 3,
            _ => self.tree.side_bits(key),
        }
    }

    fn find_block(&mut self, key: Key) {
        let difference = pack(key) ^ self.last;
        self.last = pack(key);
        if difference & OTHER_REGION != 0 {
            self.in_region = self.tree.entry(key, 2);
        }
        self.in_block = self.in_region.below(key);
    }

    /// The state of a cell.
    #[inline]
    pub(crate) fn cell_state(&mut self, key: Key) -> CellState {
        let log_odds = self.cell(key);
        OccupancyModel::state(log_odds)
    }
}

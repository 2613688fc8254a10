use crate::lattice::{Key, Lattice};
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
    /// The cube of 64^3 cells that was queried last (its key >> 6), and the tree's entry for it.
    region: Key,
    in_region: &'a Entry,
    /// The cube of 8^3 cells that was queried last (its key >> 3), and the tree's entry for it.
    block: Key,
    in_block: &'a Entry,
}

/// The block and region of a new accessor: no real block or region has this key.
const NOWHERE: Key = [u16::MAX; 3];
static NOTHING: Entry = Entry::Unknown;

impl Octree {
    /// A reader for many queries in one neighbourhood.
    pub fn accessor(&self) -> Accessor<'_> {
        Accessor {
            lattice: self.lattice,
            tree: &self.tree,
            region: NOWHERE,
            in_region: &NOTHING,
            block: NOWHERE,
            in_block: &NOTHING,
        }
    }
}

impl<'a> Accessor<'a> {
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
        let block = key.map(|index| index >> 3);
        if block != self.block {
            self.block = block;
            self.in_block = self.find_block(key);
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

    fn find_block(&mut self, key: Key) -> &'a Entry {
        let region = key.map(|index| index >> 6);
        if region != self.region {
            self.region = region;
            self.in_region = self.tree.entry(key, 2);
        }
        self.in_region.below(key)
    }

    /// The state of a cell.
    #[inline]
    pub(crate) fn cell_state(&mut self, key: Key) -> CellState {
        let log_odds = self.cell(key);
        OccupancyModel::state(log_odds)
    }
}

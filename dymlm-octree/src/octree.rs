use dymlm_core::vector3::distances_to_box;
use dymlm_core::{PointCloud, Rgb};

use crate::insertion::ScanScratch;
use crate::lattice::{DEPTH, Key, Lattice};
use crate::occupancy_model::{OccupancyModel, probability};
use crate::storage::{Forgotten, Kind, NO_COLOR, Subtree, Tree};
use crate::{CellState, Error, OctreeConfig};

/// A probabilistic occupancy octree with OctoMap's model (Hornung, Wurm, Bennewitz, Stachniss, Burgard:
/// "`OctoMap`: an efficient probabilistic 3D mapping framework based on octrees", Autonomous Robots 34,
/// 2013).
///
/// Space is divided into 65536 cells along each axis around the world's origin, whose log-odds of being
/// occupied are summed over the scans and clamped. Eight equal neighbours are one leaf, up to the largest
/// cubes that are equal throughout: the octree has 16 levels and is always pruned.
///
/// A cell is found in O(1) (six steps at most), a scan costs O(points + cells passed by its rays).
///
/// ```
/// use dymlm_octree::{CellState, Octree, OctreeConfig};
///
/// let mut config = OctreeConfig::default();
/// config.resolution = 0.1;
/// let mut map = Octree::new(config)?;
/// map.insert_scan([0.0, 0.0, 1.0], &[[2.05, 0.05, 1.05], [2.05, 0.15, 1.05]])?;
///
/// assert_eq!(map.state([2.05, 0.05, 1.05]), CellState::Occupied);
/// assert_eq!(map.state([1.05, 0.05, 1.05]), CellState::Free);
/// assert!((map.probability([2.05, 0.05, 1.05]).unwrap() - 0.7).abs() < 1e-6);
/// # Ok::<(), dymlm_octree::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Octree {
    config: OctreeConfig,
    pub(crate) lattice: Lattice,
    pub(crate) model: OccupancyModel,
    pub(crate) tree: Tree,
    pub(crate) scratch: ScanScratch,
}

/// Size of an octree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OctreeCounts {
    /// Nodes of the pruned octree, leaves included: what OctoMap calls its size.
    pub nodes: usize,
    /// Leaves of the pruned octree.
    pub leaves: usize,
    /// Leaves that are occupied.
    pub occupied_leaves: usize,
}

/// A box in the world, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Extent {
    /// Lower corner.
    pub min: [f64; 3],
    /// Upper corner.
    pub max: [f64; 3],
}

impl Octree {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: OctreeConfig) -> Result<Self, Error> {
        config.validate()?;
        let tree = Tree::new(config.color);
        Ok(Self::from_parts(config, tree))
    }

    /// The paper's plain conversion: every cell that holds points of a cloud of static points is hit once,
    /// and is occupied. Nothing is free. With [`OctreeConfig::color`] a cell has the mean colour of its
    /// points, and a larger leaf that of its cells.
    ///
    /// Points that are not finite or outside the map are skipped.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    ///
    /// ```
    /// use dymlm_core::PointCloud;
    /// use dymlm_octree::{Octree, OctreeConfig};
    ///
    /// let cloud = PointCloud::new(vec![[0.01, 0.0, 0.0], [0.02, 0.0, 0.0], [0.3, 0.0, 0.0]]);
    /// let map = Octree::from_cloud(&cloud, OctreeConfig::default())?;
    /// assert_eq!(map.counts().occupied_leaves, 2);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn from_cloud(cloud: &PointCloud, config: OctreeConfig) -> Result<Self, Error> {
        let mut map = Self::new(config)?;
        map.hit_points(cloud);
        Ok(map)
    }

    /// The settings.
    pub fn config(&self) -> &OctreeConfig {
        &self.config
    }

    /// Side of the smallest cell, metres.
    pub fn resolution(&self) -> f64 {
        self.lattice.resolution
    }

    /// Whether nothing has been observed.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty()
    }

    /// Forgets all observations.
    pub fn clear(&mut self) {
        self.tree.clear();
    }

    /// Forgets what lies farther than `radius` metres from a place, by whole blocks of 8 cells a side: these
    /// become unknown again. O(nodes stored).
    pub fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        let lattice = self.lattice;
        self.tree.forget(&|corner, side| {
            let low = lattice.corner(corner);
            let high = low.map(|c| c + f64::from(side) * lattice.resolution);
            match distances_to_box(center, [low, high]) {
                [nearest, _] if nearest > radius => Forgotten::All,
                [_, farthest] if farthest > radius => Forgotten::Part,
                _ => Forgotten::Nothing,
            }
        });
    }

    /// What is known of the cell that holds a point, metres; unknown outside the map and for NaN.
    #[inline]
    pub fn state(&self, point: [f64; 3]) -> CellState {
        OccupancyModel::state(self.log_odds(point))
    }

    /// What is known of the octree cell at `depth` (0: the whole map, 16: the smallest cells; more counts as
    /// 16) that holds a point: occupied when any cell in it is, else free when any cell in it is.
    pub fn state_at_depth(&self, point: [f64; 3], depth: u8) -> CellState {
        let max = self.lattice.key(point).and_then(|key| {
            let subtree = self.tree.subtree_at(key, depth.min(DEPTH));
            subtree.max_log_odds()
        });
        OccupancyModel::state(max)
    }

    /// Log-odds that the cell at a point is occupied; `None` where nothing is known.
    #[inline]
    pub fn log_odds(&self, point: [f64; 3]) -> Option<f32> {
        let key = self.lattice.key(point)?;
        self.tree.log_odds(key)
    }

    /// Probability that the cell at a point is occupied; `None` where nothing is known.
    pub fn probability(&self, point: [f64; 3]) -> Option<f64> {
        self.log_odds(point).map(probability)
    }

    /// The colour of the cell at a point; `None` where nothing is known of it, or without colours.
    pub fn color(&self, point: [f64; 3]) -> Option<Rgb> {
        let color = self.tree.cell_color(self.lattice.key(point)?);
        (color != NO_COLOR).then_some(color)
    }

    /// Sets the log-odds of the cell at a point, clamped; `None` makes it unknown again, and so does NaN.
    /// Nothing happens outside the map.
    pub fn set_log_odds(&mut self, point: [f64; 3], log_odds: Option<f32>) {
        if let Some(key) = self.lattice.key(point) {
            let log_odds = log_odds.filter(|value| !value.is_nan()).map(|value| self.model.clamped(value));
            self.tree.change_cell(key, |_| log_odds);
            self.tree.settle();
        }
    }

    /// Makes occupied cells free, as after one miss: the smallest cells that share a point with any of the
    /// boxes (lowest and highest corner, metres; a cell has its lower faces, not its upper ones) and for whose
    /// centre `is_free` is true. Returns their number. O(leaves and occupied smallest cells in the boxes),
    /// however large the leaves are.
    pub fn free_cells(
        &mut self,
        boxes: impl IntoIterator<Item = [[f64; 3]; 2]>,
        is_free: impl Fn([f64; 3]) -> bool,
    ) -> usize {
        let half = 0.5 * self.resolution();
        let center = |key: Key| self.lattice.corner(key).map(|c| c + half);
        let (mut freed, mut buffer): (Vec<Key>, _) = (Vec::new(), Vec::new());
        for [min, max] in boxes {
            let mut leaves = self.leaves_in_box_with(min, max, buffer);
            while let Some(leaf) = leaves.next() {
                if leaf.state == CellState::Occupied {
                    freed.extend(leaves.cells_of(&leaf).filter(|&key| is_free(center(key))));
                }
            }
            buffer = leaves.into_buffer();
        }
        // Boxes that touch share cells.
        freed.sort_unstable();
        freed.dedup();
        let model = self.model;
        for &key in &freed {
            self.tree.change_cell(key, |_| Some(model.clamped(model.miss)));
        }
        self.tree.settle();
        freed.len()
    }

    /// Counts nodes and leaves. O(blocks).
    pub fn counts(&self) -> OctreeCounts {
        let mut counts = OctreeCounts::default();
        count(self.tree.subtree(), &mut counts);
        counts
    }

    /// Bytes of memory held, buffers included, and what is shared with clones. O(blocks).
    pub fn memory_bytes(&self) -> usize {
        size_of::<Self>() + self.tree.memory_bytes_beside(None) + self.scratch.memory_bytes()
    }

    /// Bytes of memory held that another state of the map does not share. O(blocks that they do not share).
    pub fn memory_bytes_beside(&self, other: &Self) -> usize {
        size_of::<Self>() + self.tree.memory_bytes_beside(Some(&other.tree)) + self.scratch.memory_bytes()
    }

    /// The box around all leaves; `None` for an empty map. O(leaves).
    pub fn extent(&self) -> Option<Extent> {
        let mut extent: Option<Extent> = None;
        for leaf in self.leaves() {
            let corner = self.lattice.corner(leaf.key);
            let grown = extent.get_or_insert(Extent { min: corner, max: corner });
            for ((min, max), corner) in grown.min.iter_mut().zip(&mut grown.max).zip(corner) {
                *min = corner.min(*min);
                *max = max.max(corner + leaf.size);
            }
        }
        extent
    }

    /// Rounds every leaf to the clamping bound on its side of the occupancy threshold, which makes larger
    /// leaves: what [`Self::write_bt`] keeps of a map.
    pub fn to_max_likelihood(&mut self) {
        let model = self.model;
        self.tree.map_values(|log_odds| model.most_likely(log_odds));
    }

    /// Adds another map's observations as independent evidence: log-odds add up, clamped; colours are blended
    /// half and half.
    ///
    /// # Errors
    ///
    /// [`Error::Resolution`] when the cells differ in size.
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        if self.resolution() != other.resolution() {
            return Err(Error::Resolution { resolution: self.resolution(), other: other.resolution() });
        }
        self.tree.merge(&other.tree, &self.model);
        Ok(())
    }

    pub(crate) fn from_parts(config: OctreeConfig, tree: Tree) -> Self {
        Self {
            lattice: Lattice::new(config.resolution),
            model: OccupancyModel::new(&config),
            tree,
            scratch: ScanScratch::default(),
            config,
        }
    }
}

/// At most 16 calls deep.
fn count(subtree: Subtree<'_>, counts: &mut OctreeCounts) {
    match subtree.kind() {
        Kind::Absent => {}
        Kind::Leaf(log_odds) => {
            counts.nodes += 1;
            counts.leaves += 1;
            counts.occupied_leaves += usize::from(OccupancyModel::is_occupied(log_odds));
        }
        Kind::Inner => {
            counts.nodes += 1;
            for i in 0..8 {
                count(subtree.child(i), counts);
            }
        }
    }
}

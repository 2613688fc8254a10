use dymlm_core::Rgb;

use crate::lattice::{DEPTH, Key, Lattice};
use crate::occupancy_model::{OccupancyModel, probability};
use crate::storage::{Kind, NO_COLOR, Subtree, child_corner};
use crate::{CellState, Octree};

/// A leaf of the octree: a cube that is equal throughout.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Leaf {
    /// Indices along x, y, z of its first (lowest) smallest cell, 32768 at the world's origin.
    pub key: [u16; 3],
    /// Depth in the octree, 0 to 16; 16 for the smallest cells.
    pub depth: u8,
    /// Centre in the world, metres.
    pub center: [f64; 3],
    /// Side, metres.
    pub size: f64,
    /// Log-odds of being occupied.
    pub log_odds: f32,
    /// Occupied or free.
    pub state: CellState,
    /// Colour, if there is one.
    pub color: Option<Rgb>,
}

impl Leaf {
    /// Probability of being occupied.
    pub fn probability(&self) -> f64 {
        probability(self.log_odds)
    }
}

/// The buffer of [`Leaves`].
pub(crate) type LeavesBuffer<'a> = Vec<(Subtree<'a>, Key)>;

/// Iterator over leaves in OctoMap's order (depth first, x fastest). Made by [`Octree::leaves`] and
/// [`Octree::leaves_in_box`].
#[derive(Debug, Clone)]
pub struct Leaves<'a> {
    map: &'a Octree,
    /// Nodes to visit, the next one last, with their lower corners.
    stack: LeavesBuffer<'a>,
    /// First and last cell of the box.
    min: Key,
    max: Key,
}

impl Octree {
    /// All leaves.
    ///
    /// ```
    /// # use dymlm_octree::{CellState, Octree, OctreeConfig};
    /// # let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0; 3], &[[1.0, 0.0, 0.0]])?;
    /// let occupied = map.leaves().filter(|leaf| leaf.state == CellState::Occupied).count();
    /// assert_eq!(occupied, 1);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn leaves(&self) -> Leaves<'_> {
        self.leaves_with(Vec::new())
    }

    /// [`Self::leaves`] with the buffer of other leaves.
    fn leaves_with<'a>(&'a self, mut stack: LeavesBuffer<'a>) -> Leaves<'a> {
        stack.clear();
        stack.push((self.tree.subtree(), [0; 3]));
        Leaves { map: self, stack, min: [0; 3], max: [u16::MAX; 3] }
    }

    /// The leaves that share a cell with the box from `min` to `max`, metres. A box that ends before it
    /// begins, lies outside the map or has a NaN holds none.
    pub fn leaves_in_box(&self, min: [f64; 3], max: [f64; 3]) -> Leaves<'_> {
        self.leaves_in_box_with(min, max, Vec::new())
    }

    /// [`Self::leaves_in_box`] with the buffer of other leaves.
    pub(crate) fn leaves_in_box_with<'a>(
        &'a self,
        min: [f64; 3],
        max: [f64; 3],
        buffer: LeavesBuffer<'a>,
    ) -> Leaves<'a> {
        let mut leaves = self.leaves_with(buffer);
        let bounds = [0, 1, 2].map(|axis| self.lattice.index_range(min[axis], max[axis]));
        if let [Some(x), Some(y), Some(z)] = bounds {
            leaves.min = [x.0, y.0, z.0];
            leaves.max = [x.1, y.1, z.1];
        } else {
            leaves.stack.clear();
        }
        leaves
    }
}

impl Lattice {
    /// First and last index of an interval, cut at the border of the map.
    fn index_range(&self, min: f64, max: f64) -> Option<(u16, u16)> {
        let half = self.half_extent();
        if !(min <= max && min < half && max >= -half) {
            return None;
        }
        // Beyond the border, and just inside it, where rounding may lead out.
        let nearest = |coordinate: f64| if coordinate > 0.0 { u16::MAX } else { 0 };
        let index = |coordinate: f64| self.index(coordinate).unwrap_or_else(|| nearest(coordinate));
        Some((index(min), index(max)))
    }
}

impl<'a> Leaves<'a> {
    /// Ends, and gives the buffer back.
    pub(crate) fn into_buffer(self) -> LeavesBuffer<'a> {
        self.stack
    }

    /// The smallest cells of a leaf that are in the box: a leaf may be far larger than the box.
    pub(crate) fn cells_of(&self, leaf: &Leaf) -> impl Iterator<Item = Key> + use<> {
        // The last cell of the whole map has the largest index that a key can have: the side has not.
        let last = ((1_u32 << (DEPTH - leaf.depth)) - 1) as u16;
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let first = leaf.key[axis];
            first.max(self.min[axis])..=first.saturating_add(last).min(self.max[axis])
        });
        z.flat_map(move |z| {
            let x = x.clone();
            y.clone().flat_map(move |y| x.clone().map(move |x| [x, y, z]))
        })
    }

    fn overlaps(&self, corner: Key, depth: u8) -> bool {
        let last = ((1_u32 << (DEPTH - depth)) - 1) as u16;
        (0..3).all(|axis| corner[axis] <= self.max[axis] && corner[axis] + last >= self.min[axis])
    }

    fn push_children(&mut self, parent: Subtree<'a>, corner: Key) {
        for i in (0..8).rev() {
            let child = parent.child(i);
            let corner = child_corner(corner, parent.depth(), i);
            if self.overlaps(corner, child.depth()) {
                self.stack.push((child, corner));
            }
        }
    }
}

impl Iterator for Leaves<'_> {
    type Item = Leaf;

    fn next(&mut self) -> Option<Leaf> {
        let map = self.map;
        while let Some((subtree, corner)) = self.stack.pop() {
            match subtree.kind() {
                Kind::Absent => {}
                Kind::Inner => self.push_children(subtree, corner),
                Kind::Leaf(log_odds) => return Some(map.leaf(subtree, corner, log_odds)),
            }
        }
        None
    }
}

impl Octree {
    fn leaf(&self, subtree: Subtree<'_>, corner: Key, log_odds: f32) -> Leaf {
        let size = self.lattice.size(subtree.depth());
        let color = subtree.color();
        Leaf {
            key: corner,
            depth: subtree.depth(),
            center: self.lattice.corner(corner).map(|coordinate| coordinate + 0.5 * size),
            size,
            log_odds,
            state: OccupancyModel::state(Some(log_odds)),
            color: (color != NO_COLOR).then_some(color),
        }
    }
}

use std::array::from_fn;

use super::transform::Transform;
use crate::lattice::DEPTH;
use crate::{CellState, Extent, Leaf, Octree, UnknownCells};

/// The index of the cells whose lower side is the world's origin, in keys.
const CENTER: i64 = 32768;

/// Cells along the three axes. Their indices are keys but for [`CENTER`], and go on beyond the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct CellBox {
    /// Index of the first cell along each axis, 0 for the one whose lower corner is the world's origin.
    pub(super) first: [i64; 3],
    /// Number of cells along each axis.
    pub(super) size: [usize; 3],
}

impl CellBox {
    /// The cells whose centres surround each place of a region, two at least along an axis; `None` for a
    /// region that is none or too far out.
    pub(super) fn around(region: &Extent, resolution: f64) -> Option<Self> {
        let Extent { min, max } = *region;
        let is_near = |c: &f64| c.abs() / resolution < 1e9;
        if !((0..3).all(|axis| min[axis] <= max[axis]) && min.iter().chain(&max).all(is_near)) {
            return None;
        }
        let last_before = |c: f64| (c / resolution - 0.5).floor() as i64;
        let first = min.map(last_before);
        let size = from_fn(|axis| (last_before(max[axis]) - first[axis] + 2) as usize);
        Some(Self { first, size })
    }

    /// With so many more cells on each side; `None` when their number is beyond counting.
    pub(super) fn grown(&self, cells: usize) -> Option<Self> {
        let size = self.size.map(|side| side + 2 * cells);
        size.iter().try_fold(1_u64, |product, &side| product.checked_mul(side as u64))?;
        Some(Self { first: self.first.map(|index| index - cells as i64), size })
    }

    pub(super) fn len(&self) -> u64 {
        self.size.iter().map(|&side| side as u64).product()
    }

    /// Place of a cell, given from the first on, in an array with x fastest.
    #[inline]
    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Centre of the first and of the last cell.
    fn centers(&self, resolution: f64) -> [[f64; 3]; 2] {
        let center = |index: i64| (index as f64 + 0.5) * resolution;
        [from_fn(|axis| center(self.first[axis])), from_fn(|axis| center(self.last(axis)))]
    }

    fn last(&self, axis: usize) -> i64 {
        self.first[axis] + self.size[axis] as i64 - 1
    }
}

impl Transform {
    /// Notes which cells of a box are obstacles.
    pub(super) fn find_obstacles(&mut self, map: &Octree, around: &CellBox, unknown: UnknownCells) {
        let is_unknown_obstacle = unknown == UnknownCells::Stop;
        self.obstacles.clear();
        self.obstacles.resize(around.len() as usize, is_unknown_obstacle);
        let [min, max] = around.centers(map.resolution());
        for leaf in map.leaves_in_box(min, max) {
            let is_obstacle = leaf.state == CellState::Occupied;
            if is_obstacle != is_unknown_obstacle {
                self.mark(around, &leaf, is_obstacle);
            }
        }
    }

    fn mark(&mut self, around: &CellBox, leaf: &Leaf, is_obstacle: bool) {
        let side = 1_i64 << (DEPTH - leaf.depth);
        // The part of the leaf in the box, from and to.
        let [x, y, z] = from_fn(|axis| {
            let first = i64::from(leaf.key[axis]) - CENTER;
            let from = (first - around.first[axis]).max(0) as usize;
            let to = (first + side).min(around.last(axis) + 1) - around.first[axis];
            from..to.max(0) as usize
        });
        for z in z {
            for y in y.clone() {
                let row = around.index([0, y, z]);
                if let Some(cells) = self.obstacles.get_mut(row + x.start..row + x.end) {
                    cells.fill(is_obstacle);
                }
            }
        }
    }
}

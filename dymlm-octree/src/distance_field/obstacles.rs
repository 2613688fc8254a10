use std::array::from_fn;

use super::cell_box::CellBox;
use super::transform::Transform;
use crate::lattice::DEPTH;
use crate::{CellState, Leaf, Octree, UnknownCells};

/// Index, in keys, of the cells whose lower side is at the world's origin.
const CENTER: i64 = 32768;

impl Transform {
    /// Marks the cells of a box that are obstacles.
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
        // The part of the leaf inside the box, as ranges of indices.
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

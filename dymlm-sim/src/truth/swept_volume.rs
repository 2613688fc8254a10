use std::ops::RangeInclusive;

use dymlm_core::vector3::norm;
use dymlm_core::{Point, Pose};
use parry3d::math::Vec3;

use super::cell_grid::{CellGrid, bounds};
use crate::SimulatedFrame;
use crate::scene::Part;

/// The cells of 5 cm whose centres are in a body, or within a margin of one, at one of the given times.
///
/// They are kept by blocks. Adding a body skips the blocks that are swept whole or out of its reach; a frame skips the
/// blocks that are out of its view.
#[derive(Debug, Clone)]
pub(super) struct SweptVolume {
    cells: CellGrid,
    blocks: CellGrid,
    /// By block, a bit for each cell.
    swept: Vec<u64>,
    /// The blocks with swept cells, ascending, and the number of frames that looked through each cell.
    looks: Vec<(usize, Box<[u32; BLOCK_CELLS]>)>,
}

const CELL: f32 = 0.05;
/// Cells of a block along each axis, and in all.
const BLOCK_SIDE: usize = 4;
const BLOCK_CELLS: usize = BLOCK_SIDE * BLOCK_SIDE * BLOCK_SIDE;
/// From the middle of a block to the middles of its outermost cells, metres, rounded up.
const BLOCK_RADIUS: f32 = 0.131;
/// Half a cell's diagonal, metres: a ray that goes on for longer behind a cell's centre leaves the cell.
const HALF_DIAGONAL: f64 = 0.043_3;

impl SweptVolume {
    /// `bodies_at` replaces the contents of a list by the bodies at a time.
    pub(super) fn new(
        times: impl Iterator<Item = f64> + Clone,
        margin: f32,
        bodies_at: impl Fn(f64, &mut Vec<Part>),
    ) -> Self {
        let mut bodies = Vec::new();
        let mut cells = CellGrid::EMPTY;
        for time in times.clone() {
            bodies_at(time, &mut bodies);
            cells = cells.joined(CellGrid::around(&bodies, margin + CELL, CELL));
        }
        let blocks = cells.coarser(BLOCK_SIDE);
        let mut volume = Self { cells, blocks, swept: vec![0; blocks.len()], looks: Vec::new() };
        for time in times {
            bodies_at(time, &mut bodies);
            for body in &bodies {
                volume.add(body, margin);
            }
        }
        let filled = volume.swept.iter().enumerate().filter(|(_, cells)| **cells != 0);
        volume.looks = filled.map(|(block, _)| (block, Box::new([0; BLOCK_CELLS]))).collect();
        volume
    }

    /// Adds the cells in a body and within a margin of it.
    fn add(&mut self, body: &Part, margin: f32) {
        let [center, half] = bounds(body);
        let reaches = |place: Vec3, margin: f32| {
            body.shape.reaches(body.scene_from_part.inverse_transform_point(place), margin)
        };
        for block in self.blocks.cells_within([center, half + Vec3::splat(margin)]) {
            let middle = self.blocks.center(block);
            if self.swept[block] == u64::MAX || !reaches(middle, margin + BLOCK_RADIUS) {
                continue;
            }
            if margin > BLOCK_RADIUS && reaches(middle, margin - BLOCK_RADIUS) {
                self.swept[block] = u64::MAX;
                continue;
            }
            for cell in 0..BLOCK_CELLS {
                let is_swept =
                    self.swept[block] >> cell & 1 == 1 || reaches(self.center(block, cell), margin);
                self.swept[block] |= u64::from(is_swept) << cell;
            }
        }
    }

    /// The middle of a cell of a block.
    fn center(&self, block: usize, cell: usize) -> Vec3 {
        let (side, first) = (BLOCK_SIDE, self.blocks.place_of(block).map(|c| c * BLOCK_SIDE));
        let [x, y, z] = [cell / (side * side), cell / side % side, cell % side];
        self.cells.center_of([first[0] + x, first[1] + y, first[2] + z])
    }

    /// Notes which cells within range a frame looks through.
    pub(super) fn look(
        &mut self,
        frame: &SimulatedFrame,
        camera_from_scene: &Pose,
        range: &RangeInclusive<f64>,
    ) {
        let camera = frame.frame.camera();
        let [right, bottom] = [camera.width(), camera.height()].map(|side| side as f64 - 0.5);
        let ray_lengths = [[-0.5, -0.5], [right, -0.5], [-0.5, bottom], [right, bottom]]
            .map(|corner| norm(camera.back_project(corner, 1.0)));
        let radius = f64::from(BLOCK_RADIUS);
        let farthest = ray_lengths.into_iter().fold(1.0, f64::max) * range.end() + radius;
        let in_camera = |place: Vec3| camera_from_scene.transform_point(place.to_array().map(f64::from));
        let mut blocks = std::mem::take(&mut self.looks);
        for (block, looks) in &mut blocks {
            let middle = in_camera(self.blocks.center(*block));
            if norm(middle) > farthest || middle[2] + radius < *range.start() {
                continue;
            }
            for cell in (0..BLOCK_CELLS).filter(|cell| self.swept[*block] >> cell & 1 == 1) {
                let place = in_camera(self.center(*block, cell));
                looks[cell] += u32::from(frame.looks_through(place, range, HALF_DIAGONAL));
            }
        }
        self.looks = blocks;
    }

    /// Whether at least this many frames looked through the cell of a point.
    pub(super) fn is_looked_through(&self, point: Point, least: u32) -> bool {
        let looks = self.cell(point).and_then(|(block, cell)| {
            let index = self.looks.binary_search_by_key(&block, |(block, _)| *block).ok()?;
            Some(self.looks[index].1[cell])
        });
        looks.is_some_and(|looks| looks >= least)
    }

    pub(super) fn contains(&self, point: Point) -> bool {
        self.cell(point).is_some_and(|(block, cell)| self.swept[block] >> cell & 1 == 1)
    }

    /// The block that holds a point, and its cell.
    fn cell(&self, point: Point) -> Option<(usize, usize)> {
        let place = self.cells.place(point.into())?;
        let [x, y, z] = place.map(|c| c % BLOCK_SIDE);
        Some((self.blocks.index(place.map(|c| c / BLOCK_SIDE)), (x * BLOCK_SIDE + y) * BLOCK_SIDE + z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Activity;
    use crate::scene::{Cast, Scene};

    #[test]
    fn holds_the_bodies_and_their_margin_and_no_more() {
        let scene = Scene::office(&Cast::usual(Activity::Walking, 2));
        let times = [0.0, 0.7];
        let swept = SweptVolume::new(times.into_iter(), 0.1, |time, bodies| scene.moving_parts(time, bodies));
        let mut at_times = vec![Vec::new(); 2];
        times.iter().zip(&mut at_times).for_each(|(&time, bodies)| scene.moving_parts(time, bodies));
        let bodies: Vec<_> = at_times.concat();
        let mut inside = 0;
        for k in 0..20_000 {
            let along = |step: f64, reach: f64| ((f64::from(k) * step).fract() * 2.0 * reach - reach) as f32;
            let point = Vec3::new(along(0.754_877, 2.9), along(0.569_840, 2.6), along(0.438_579, 1.3) + 1.3);
            let reached = |margin: f32| {
                bodies.iter().any(|body| {
                    body.shape.reaches(body.scene_from_part.inverse_transform_point(point), margin)
                })
            };
            // Half a cell's diagonal is 4.4 cm.
            let contained = swept.contains(point.to_array());
            assert!(contained || !reached(0.055), "{point} is within 5.5 cm of a body");
            assert!(!contained || reached(0.145), "{point} is not within 14.5 cm of a body");
            inside += usize::from(contained);
        }
        assert!(inside > 100, "{inside} points inside");
        let nobody = SweptVolume::new(times.into_iter(), 0.1, |_, bodies| bodies.clear());
        assert!(!nobody.contains([0.0, 0.0, 1.0]));
    }
}

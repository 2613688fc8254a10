use std::ops::RangeInclusive;

use dymlm_core::{Point, Pose};
use parry3d::math::Vec3;

use super::cell_grid::{CellGrid, bounds};
use crate::SimulatedFrame;
use crate::scene::Part;

/// The cells of 5 cm whose centres are in a body, or within a margin of one, at one of the given times.
#[derive(Debug, Clone)]
pub(super) struct SweptVolume {
    grid: CellGrid,
    swept: Vec<bool>,
    /// Number of frames that looked through each cell.
    looks: Vec<u32>,
}

const CELL: f32 = 0.05;
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
        let mut grid = CellGrid::EMPTY;
        for time in times.clone() {
            bodies_at(time, &mut bodies);
            grid = grid.joined(CellGrid::around(&bodies, margin + CELL, CELL));
        }

        let mut swept = vec![false; grid.len()];
        for time in times {
            bodies_at(time, &mut bodies);
            for body in &bodies {
                let [center, half] = bounds(body);
                for cell in grid.cells_within([center, half + Vec3::splat(margin)]) {
                    let local = || body.scene_from_part.inverse_transform_point(grid.center(cell));
                    swept[cell] = swept[cell] || body.shape.reaches(local(), margin);
                }
            }
        }
        Self { looks: vec![0; grid.len()], grid, swept }
    }

    /// Notes which cells within range a frame looks through.
    pub(super) fn look(
        &mut self,
        frame: &SimulatedFrame,
        camera_from_scene: &Pose,
        range: &RangeInclusive<f64>,
    ) {
        for cell in (0..self.swept.len()).filter(|&cell| self.swept[cell]) {
            let center = self.grid.center(cell).to_array().map(f64::from);
            let place = camera_from_scene.transform_point(center);
            self.looks[cell] += u32::from(frame.looks_through(place, range, HALF_DIAGONAL));
        }
    }

    /// Whether at least this many frames looked through the cell of a point.
    pub(super) fn is_looked_through(&self, point: Point, least: u32) -> bool {
        self.grid.cell(point.into()).is_some_and(|cell| self.looks[cell] >= least)
    }

    pub(super) fn contains(&self, point: Point) -> bool {
        self.grid.cell(point.into()).is_some_and(|cell| self.swept[cell])
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

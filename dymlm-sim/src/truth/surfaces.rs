use dymlm_core::Point;
use parry3d::math::{Mat3, Vec3};

use super::cell_grid::CellGrid;
use crate::scene::{Part, Shape};

/// Exact distances to the surfaces of many bodies.
///
/// Each cell of a 25 cm grid keeps the bodies that can be nearest to any of its points: bodies not farther
/// from its centre than the nearest body plus the cell's diagonal. A query tests only these few.
#[derive(Debug, Clone)]
pub(super) struct Surfaces {
    bodies: Vec<Body>,
    grid: CellGrid,
    /// The bodies of all cells one after the other, and where those of each cell begin.
    candidates: Vec<u16>,
    begins: Vec<u32>,
}

#[derive(Debug, Clone)]
struct Body {
    shape: Shape,
    part_from_scene: Mat3,
    center: Vec3,
}

const CELL: f32 = 0.25;
/// Side of the blocks that preselect bodies for their cells, metres.
const BLOCK: f32 = 2.0;

impl Surfaces {
    pub(super) fn new(parts: &[Part]) -> Self {
        let bodies: Vec<Body> = parts
            .iter()
            .take(usize::from(u16::MAX))
            .map(|part| Body {
                shape: part.shape,
                part_from_scene: Mat3::from_quat(part.scene_from_part.rotation.inverse()),
                center: part.scene_from_part.translation,
            })
            .collect();

        // Blocks of cells test all bodies; cells test only the bodies that can be nearest in their block.
        let blocks = CellGrid::around(parts, 0.5, BLOCK);
        let everybody: Vec<u16> = (0..bodies.len() as u16).collect();
        let mut in_block: Vec<Option<Vec<u16>>> = vec![None; blocks.len()];
        let mut distances = Vec::new();
        let mut nearest = |among: &[u16], center: Vec3, size: f32, found: &mut Vec<u16>| {
            distances.clear();
            distances.extend(among.iter().map(|&i| bodies[usize::from(i)].distance(center)));
            let bound =
                distances.iter().copied().fold(f32::INFINITY, f32::min) + 1.01 * size * 3.0_f32.sqrt();
            let near = among.iter().zip(&distances).filter(|&(_, &distance)| distance <= bound);
            found.extend(near.map(|(&i, _)| i));
        };
        let grid = CellGrid::around(parts, 0.5, CELL);
        let mut candidates = Vec::new();
        let mut begins = vec![0];
        for cell in 0..grid.len() {
            let center = grid.center(cell);
            let block = blocks.cell(center);
            let in_block = block.and_then(|block| {
                let slot = in_block.get_mut(block)?;
                Some(slot.get_or_insert_with(|| {
                    let mut found = Vec::new();
                    nearest(&everybody, blocks.center(block), BLOCK, &mut found);
                    found
                }))
            });
            nearest(in_block.map_or(&everybody[..], |found| found), center, CELL, &mut candidates);
            begins.push(candidates.len() as u32);
        }
        Self { bodies, grid, candidates, begins }
    }

    /// Distance to the nearest surface, metres; infinite when there is none.
    pub(super) fn distance(&self, point: Point) -> f32 {
        let point = Vec3::from(point);
        let nearest = |distance: f32, body: &Body| distance.min(body.distance(point));
        match self.grid.cell(point) {
            Some(cell) => {
                let range = self.begins[cell] as usize..self.begins[cell + 1] as usize;
                self.candidates[range]
                    .iter()
                    .map(|&i| &self.bodies[usize::from(i)])
                    .fold(f32::INFINITY, nearest)
            }
            None => self.bodies.iter().fold(f32::INFINITY, nearest),
        }
    }
}

impl Body {
    fn distance(&self, point: Vec3) -> f32 {
        self.shape.surface_distance(self.part_from_scene * (point - self.center))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Activity;
    use crate::scene::{Cast, Scene};

    #[test]
    fn the_grid_changes_no_distance() {
        let parts = Scene::office(&Cast::usual(Activity::Walking, 0)).static_parts;
        let surfaces = Surfaces::new(&parts);
        for k in 0..4000 {
            // Low-discrepancy points, some of them outside the room and its grid.
            let along = |step: f64, reach: f64| ((f64::from(k) * step).fract() * 2.0 * reach - reach) as f32;
            let point = Vec3::new(along(0.754_877, 4.0), along(0.569_840, 3.5), along(0.438_579, 1.8) + 1.3);
            let brute = surfaces.bodies.iter().map(|body| body.distance(point)).fold(f32::INFINITY, f32::min);
            assert_eq!(surfaces.distance(point.to_array()), brute, "at {point}");
        }
        assert_eq!(Surfaces::new(&[]).distance([0.0; 3]), f32::INFINITY);
    }
}

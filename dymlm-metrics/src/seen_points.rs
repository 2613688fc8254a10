use dymlm_core::Point;

use crate::voxel_key::{VoxelKey, VoxelMap};

/// Points thinned to the first one in each cube of a lattice, with the number of frames that saw a point in
/// the cube. No surface at whole centimetres is on a border of cubes ([`VoxelKey::on_surface`]).
#[derive(Debug, Clone)]
pub struct SeenPoints {
    cubes_per_metre: f32,
    frames: u32,
    cubes: VoxelMap<Seen>,
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    point: Point,
    views: u32,
    last_frame: u32,
}

impl SeenPoints {
    /// No points yet, in cubes of side `cube` metres.
    pub fn new(cube: f64) -> Self {
        Self { cubes_per_metre: (1.0 / cube) as f32, frames: 0, cubes: VoxelMap::default() }
    }

    /// Begins the next frame, to which the points seen from now on belong. Returns its number, counted from
    /// 1.
    pub fn next_frame(&mut self) -> u32 {
        self.frames = self.frames.saturating_add(1);
        self.frames
    }

    /// Adds a point that the present frame sees; a point that is not finite is ignored.
    #[inline]
    pub fn see(&mut self, point: Point) {
        let Some(cube) = VoxelKey::on_surface(point, self.cubes_per_metre) else { return };
        let seen = self.cubes.entry(cube).or_insert(Seen { point, views: 0, last_frame: 0 });
        seen.views += u32::from(seen.last_frame != self.frames);
        seen.last_frame = self.frames;
    }

    /// The points of the cubes that at least `min_views` frames saw, in the order of the lattice.
    pub fn points(&self, min_views: u32) -> Vec<Point> {
        // Sorted, so that the order of the hash table has no effect.
        let often = self.cubes.iter().filter(|(_, seen)| seen.views >= min_views);
        let mut often: Vec<(VoxelKey, Point)> = often.map(|(&cube, seen)| (cube, seen.point)).collect();
        often.sort_unstable_by_key(|&(cube, _)| cube);
        often.into_iter().map(|(_, point)| point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_counts_once_a_frame_and_keeps_its_first_point() {
        let mut seen = SeenPoints::new(0.1);
        assert_eq!(seen.next_frame(), 1);
        for point in [[0.55, 0.0, 0.0], [0.51, 0.0, 0.0], [0.25, 0.0, 0.0], [f32::NAN, 0.0, 0.0]] {
            seen.see(point);
        }
        assert_eq!(seen.points(1), [[0.25, 0.0, 0.0], [0.55, 0.0, 0.0]]);
        assert!(seen.points(2).is_empty());
        assert_eq!(seen.next_frame(), 2);
        seen.see([0.52, 0.0, 0.0]);
        assert_eq!(seen.points(2), [[0.55, 0.0, 0.0]]);
    }
}

use std::ops::RangeInclusive;

use dymlm_core::{Frame, Point, Pose};

use crate::voxel_key::{VoxelKey, VoxelMap};

/// Points collected in the voxels of a lattice: their number and mean, and the number of frames that hit each
/// voxel.
#[derive(Debug, Clone)]
pub(crate) struct VoxelMeans {
    voxels_per_metre: f32,
    frames: u32,
    voxels: VoxelMap<Voxel>,
}

/// The points in a voxel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Voxel {
    sum: [f64; 3],
    pub(crate) points: u64,
    pub(crate) frames: u32,
    /// The last frame that hit the voxel, counted from 1.
    last_frame: u32,
}

impl Voxel {
    pub(crate) fn mean(&self) -> Point {
        self.sum.map(|sum| (sum / self.points.max(1) as f64) as f32)
    }

    fn add(&mut self, other: &Self) {
        (0..3).for_each(|axis| self.sum[axis] += other.sum[axis]);
        self.points += other.points;
    }
}

impl VoxelMeans {
    /// No points yet, in voxels of side `voxel_size`, metres.
    pub(crate) fn new(voxel_size: f64) -> Self {
        Self { voxels_per_metre: (1.0 / voxel_size) as f32, frames: 0, voxels: VoxelMap::default() }
    }

    /// Adds the points of the next frame. Points that are not finite are ignored.
    pub(crate) fn add_frame(&mut self, points: impl Iterator<Item = [f64; 3]>) {
        self.frames += 1;
        // Neighbouring pixels are often in the same voxel: each run of them needs one look-up.
        let mut run = (None, Voxel::default());
        for point in points {
            let key = VoxelKey::of(point.map(|c| c as f32), self.voxels_per_metre);
            if key != run.0 {
                self.add_run(run);
                run = (key, Voxel::default());
            }
            run.1.add(&Voxel { sum: point, points: 1, ..Voxel::default() });
        }
        self.add_run(run);
    }

    fn add_run(&mut self, (key, run): (Option<VoxelKey>, Voxel)) {
        let Some(key) = key else { return };
        let voxel = self.voxels.entry(key).or_default();
        voxel.add(&run);
        voxel.frames += u32::from(voxel.last_frame != self.frames);
        voxel.last_frame = self.frames;
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.voxels.len()
    }

    /// The voxels in lattice order, so that the order of the hash table has no effect.
    pub(crate) fn voxels(&self) -> Vec<Voxel> {
        let mut voxels: Vec<(VoxelKey, Voxel)> =
            self.voxels.iter().map(|(&key, &voxel)| (key, voxel)).collect();
        voxels.sort_unstable_by_key(|&(key, _)| key);
        voxels.into_iter().map(|(_, voxel)| voxel).collect()
    }
}

/// The readings of a frame within `depths`, metres: the pixel of each, and its position in the world.
pub(crate) fn readings<'a>(
    frame: &'a Frame,
    world_from_camera: &'a Pose,
    depths: RangeInclusive<f32>,
) -> impl Iterator<Item = (usize, [f64; 3])> + 'a {
    let (camera, width) = (frame.camera(), frame.depth().width());
    let read = frame.depth().data().iter().enumerate().filter(move |&(_, z)| *z > 0.0 && depths.contains(z));
    read.map(move |(pixel, &z)| {
        let point = camera.back_project([(pixel % width) as f64, (pixel / width) as f64], z.into());
        (pixel, world_from_camera.transform_point(point))
    })
}

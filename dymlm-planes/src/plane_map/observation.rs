use dymlm_core::vector3::norm;
use dymlm_core::{Plane, PlaneId, Pose};

use super::fixed_moments::{FixedMoments, REACH};
use crate::association::FinitePlane;
use crate::detector::{DetectedPlane, PlaneSamples};
use crate::error::Error;
use crate::moments::Moments;
use crate::patches::{Patch, PatchVoxel, reach};

/// What a key frame has seen of a plane, in its camera's frame: enough to add it to the map at any pose, and to
/// take it out again to the bit.
#[derive(Debug, Clone)]
pub(super) struct Share {
    /// The plane at that time; it may have merged into another since.
    pub(super) plane: PlaneId,
    /// Whether the plane was seen from behind.
    is_flipped: bool,
    moments: Moments,
    samples: PlaneSamples,
    /// How it has moved in the world since, if it has.
    motion: Option<Box<Pose>>,
}

/// A share in the world.
#[derive(Debug, Clone)]
pub(super) struct PlacedShare {
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
}

/// A detected plane, brought to the world.
#[derive(Debug, Clone)]
pub(super) struct Observation {
    pub(super) share: Share,
    pub(super) placed: PlacedShare,
    pub(super) edge_points: Vec<[f64; 3]>,
}

/// How far from the world's origin planes can be summed, metres: a frame's samples lie within a hundred metres
/// of their centroid.
pub(super) fn reach_of_planes(voxel_size: f64) -> f64 {
    REACH.min(reach(voxel_size)) - 100.0
}

impl Share {
    /// The pose at which it stands in the world now, given the key frame's.
    fn pose(&self, world_from_camera: &Pose) -> Pose {
        self.motion.as_ref().map_or(*world_from_camera, |motion| **motion * *world_from_camera)
    }

    /// It in the world, the same bits each time. O(samples).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`].
    pub(super) fn placed(&self, world_from_camera: &Pose, voxel_size: f64) -> Result<PlacedShare, Error> {
        let pose = self.pose(world_from_camera);
        let centroid = pose.transform_point(self.moments.centroid());
        let reach = reach_of_planes(voxel_size);
        let within = centroid.iter().all(|c| c.abs() < reach);
        // Never is a detected plane's fit no plane.
        let own = self.moments.fit().filter(|_| within).and_then(|fit| fit.plane());
        let placed = own.and_then(|own| {
            let seen = own.transformed(&pose);
            let normal = if self.is_flipped { seen.normal().map(|n| -n) } else { seen.normal() };
            let moments = FixedMoments::new(&self.moments.transformed(&pose), normal)?;
            let (rotation, translation) = (pose.rotation_matrix(), pose.translation());
            let to_world = |[x, y, z]: [f64; 3]| {
                std::array::from_fn(|axis| {
                    let [a, b, c] = rotation[axis];
                    a * x + b * y + c * z + translation[axis]
                })
            };
            let patch =
                Patch::of_points(self.samples.points_within(&own, voxel_size).map(to_world), voxel_size);
            Some(PlacedShare { plane: seen, centroid, moments, patch })
        });
        placed.ok_or(Error::OutOfReach { centroid, reach })
    }

    /// The same, seen from behind.
    pub(super) fn flipped(self) -> Self {
        Self { is_flipped: !self.is_flipped, ..self }
    }

    /// The same, moved in the world.
    pub(super) fn moved(&self, new_from_old: &Pose) -> Self {
        let motion = self.motion.as_ref().map_or(*new_from_old, |motion| *new_from_old * **motion);
        Self { motion: Some(Box::new(motion)), ..self.clone() }
    }

    /// Keeps those samples whose voxels in the world are wanted.
    pub(super) fn retain(
        &mut self,
        world_from_camera: &Pose,
        voxel_size: f64,
        is_wanted: impl Fn(PatchVoxel) -> bool,
    ) {
        let pose = self.pose(world_from_camera);
        let Some(own) = self.moments.fit().and_then(|fit| fit.plane()) else { return };
        let mut points = self.samples.points(&own);
        let kept = self.samples.retained(|_| {
            let point = points.next().map(|point| pose.transform_point(point));
            let cell = point.map(|point| point.map(|c| (c / voxel_size).floor() as i32));
            cell.is_some_and(|cell| is_wanted(PatchVoxel { cell, count: 1 }))
        });
        drop(points);
        self.samples = kept;
    }

    /// Whether it lies farther than `radius` metres from a place in the world with all that it shows.
    pub(super) fn is_outside(
        &self,
        world_from_camera: &Pose,
        voxel_size: f64,
        center: [f64; 3],
        radius: f64,
    ) -> bool {
        let pose = self.pose(world_from_camera);
        let Some(own) = self.moments.fit().and_then(|fit| fit.plane()) else { return true };
        let mut points = self.samples.points(&own).map(|point| pose.transform_point(point));
        points.all(|point| norm(dymlm_core::vector3::difference(point, center)) > radius + voxel_size)
    }

    /// Bytes on the heap.
    pub(super) fn memory_bytes(&self) -> usize {
        self.samples.memory_bytes() + self.motion.as_ref().map_or(0, |_| size_of::<Pose>())
    }
}

impl Observation {
    pub(super) fn new(
        detected: &DetectedPlane,
        world_from_camera: &Pose,
        voxel_size: f64,
    ) -> Result<Self, Error> {
        let share = Share {
            plane: PlaneId::new(0),
            is_flipped: false,
            moments: detected.moments,
            samples: detected.samples.clone(),
            motion: None,
        };
        let placed = share.placed(world_from_camera, voxel_size)?;
        let to_world = |point: &[f32; 3]| world_from_camera.transform_point(point.map(f64::from));
        Ok(Self { share, placed, edge_points: detected.edge_points.iter().map(to_world).collect() })
    }

    pub(super) fn finite(&self) -> FinitePlane<'_> {
        FinitePlane {
            plane: self.placed.plane,
            centroid: self.placed.centroid,
            patch: &self.placed.patch,
            edge_points: Some(&self.edge_points),
        }
    }
}

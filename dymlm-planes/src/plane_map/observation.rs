use dymlm_core::{Plane, Pose};

use super::fixed_moments::{FixedMoments, REACH};
use crate::association::FinitePlane;
use crate::detector::DetectedPlane;
use crate::error::Error;
use crate::patch::{Bounds, Patch, reach};

/// A detected plane, brought to the world.
#[derive(Debug, Clone)]
pub(super) struct Observation {
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) edge_points: Vec<[f64; 3]>,
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
    bounds: Bounds,
}

impl Observation {
    pub(super) fn new(
        detected: &DetectedPlane,
        world_from_camera: &Pose,
        voxel_size: f64,
    ) -> Result<Self, Error> {
        let plane = detected.plane.transformed(world_from_camera);
        let centroid = world_from_camera.transform_point(detected.centroid);
        let reach = Self::reach(voxel_size);
        let out_of_reach = || Error::OutOfReach { centroid, reach };
        if !centroid.iter().all(|c| c.abs() < reach) {
            return Err(out_of_reach());
        }
        let moments = FixedMoments::new(&detected.moments.transformed(world_from_camera), plane.normal())
            .ok_or_else(out_of_reach)?;
        let patch = Patch::of_samples(&detected.samples, world_from_camera, voxel_size);
        Ok(Self {
            plane,
            centroid,
            edge_points: detected
                .edge_points
                .iter()
                .map(|point| world_from_camera.transform_point(point.map(f64::from)))
                .collect(),
            moments,
            bounds: patch.bounds(voxel_size),
            patch,
        })
    }

    /// How far from the world's origin planes can be summed, metres: a frame's samples lie within a hundred
    /// metres of their centroid.
    pub(super) fn reach(voxel_size: f64) -> f64 {
        REACH.min(reach(voxel_size)) - 100.0
    }

    pub(super) fn finite(&self) -> FinitePlane<'_> {
        FinitePlane {
            plane: self.plane,
            centroid: self.centroid,
            patch: &self.patch,
            bounds: self.bounds,
            edge_points: Some(&self.edge_points),
        }
    }
}

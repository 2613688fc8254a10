use dymlm_core::{Plane, Pose};

use super::fixed_moments::{FixedMoments, REACH};
use crate::association::FinitePlane;
use crate::detector::DetectedPlane;
use crate::patches::{Patch, reach};

/// A key frame's share of a plane, placed in the world.
#[derive(Debug, Clone)]
pub(super) struct PlacedShare {
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
}

/// A detected plane, transformed to the world.
#[derive(Debug, Clone)]
pub(super) struct Observation {
    pub(super) placed: PlacedShare,
    edge_points: Vec<[f64; 3]>,
}

/// Largest coordinate at which planes can be summed, metres: a frame's samples lie within a hundred metres of
/// their centroid.
pub(super) fn reach_of_planes(voxel_size: f64) -> f64 {
    REACH.min(reach(voxel_size)) - 100.0
}

impl Observation {
    pub(super) fn new(detected: &DetectedPlane, placed: PlacedShare, world_from_camera: &Pose) -> Self {
        let to_world = |point| world_from_camera.transform_point(point);
        Self { placed, edge_points: detected.edge_points().map(to_world).collect() }
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

use dymlm_core::Plane;

use super::fixed_moments::{FixedMoments, REACH};
use crate::association::FinitePlane;
use crate::patches::{Patch, reach};

/// A key frame's share of a plane, placed in the world.
#[derive(Debug, Clone)]
pub(super) struct PlacedShare {
    pub(super) plane: Plane,
    pub(super) centroid: [f64; 3],
    pub(super) moments: FixedMoments,
    pub(super) patch: Patch,
}

/// Largest coordinate at which planes can be summed, metres: a frame's samples lie within a hundred metres of
/// their centroid.
pub(super) fn reach_of_planes(voxel_size: f64) -> f64 {
    REACH.min(reach(voxel_size)) - 100.0
}

impl PlacedShare {
    pub(super) fn finite(&self) -> FinitePlane<'_> {
        FinitePlane {
            plane: self.plane,
            centroid: self.centroid,
            spread: self.moments.spread(),
            patch: &self.patch,
        }
    }
}

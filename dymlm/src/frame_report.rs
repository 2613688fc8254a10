use dymlm_cloud::CloudFrameReport;
use dymlm_dynamics::Mover;
use dymlm_objects::ObjectReport;
use dymlm_octree::InsertReport;
use dymlm_planes::PlaneReport;

use crate::StageTimes;

/// What one frame has done: who moved in it, what was masked, and what came into the maps.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FrameReport {
    /// The frame's time, seconds.
    pub timestamp: f64,
    /// Potential movers in the frame, detected or predicted, by ascending track id.
    pub movers: Vec<Mover>,
    /// Pixels that were masked as moving.
    pub masked_pixels: usize,
    /// What came into the maps; `None` when the frame was no key frame.
    pub update: Option<MapUpdate>,
    /// How long each step took.
    pub stages: StageTimes,
}

/// What a key frame has brought into the maps.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MapUpdate {
    /// Into the dense cloud.
    pub cloud: CloudFrameReport,
    /// Into the octree.
    pub octree: InsertReport,
    /// Into the plane map.
    pub planes: PlaneReport,
    /// Into the object map.
    pub objects: ObjectReport,
}

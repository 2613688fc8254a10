use dymlm_cloud::CloudFrameReport;
use dymlm_core::{FrameId, ObjectId};
use dymlm_dynamics::Mover;
use dymlm_objects::ObjectReport;
use dymlm_octree::InsertReport;
use dymlm_planes::PlaneReport;

use crate::{CorrectionReport, StageTimes};

/// What one frame has done: who moved in it, what was masked, and what came into the maps.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FrameReport {
    /// The frame's id, which names it from now on.
    pub id: FrameId,
    /// The frame's time, seconds.
    pub timestamp: f64,
    /// What became of the frame.
    pub outcome: FrameOutcome,
    /// Potential movers in the frame, detected or predicted, by ascending track id. Empty while the frame
    /// waits.
    pub movers: Vec<Mover>,
    /// Pixels that were masked as moving; with a [stride](dymlm_core::SensorModel::stride), those that stand
    /// for as many.
    pub masked_pixels: usize,
    /// How long each step took.
    pub stages: StageTimes,
    /// Reports of the other frames that this call has processed, in the order of time: they had waited for
    /// detections.
    pub released: Vec<FrameReport>,
}

impl FrameReport {
    /// The report of a frame that waits.
    pub(crate) fn waiting(id: FrameId, timestamp: f64) -> Self {
        Self {
            id,
            timestamp,
            outcome: FrameOutcome::Waiting,
            movers: Vec::new(),
            masked_pixels: 0,
            stages: StageTimes::default(),
            released: Vec::new(),
        }
    }

    /// What the frame has brought into the maps; `None` when it waits or is no key frame.
    pub fn update(&self) -> Option<&MapUpdate> {
        match &self.outcome {
            FrameOutcome::Mapped(update) => Some(update),
            _ => None,
        }
    }

    /// What a [scan](crate::MapBuilder::insert_scan) has brought into the maps; `None` for a frame.
    pub fn scan(&self) -> Option<&ScanUpdate> {
        match &self.outcome {
            FrameOutcome::Scanned(update) => Some(update),
            _ => None,
        }
    }
}

/// What became of a frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum FrameOutcome {
    /// It waits for its detections, or behind a frame that does.
    Waiting,
    /// Movers were tracked in it; it is no key frame.
    Tracked,
    /// It is a key frame and was mapped.
    Mapped(Box<MapUpdate>),
    /// It is no frame but a scan, and was mapped.
    Scanned(ScanUpdate),
    /// It had been mapped without detections, and was mapped again when they came.
    Mended(Box<CorrectionReport>),
}

/// What a scan has brought into the maps.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ScanUpdate {
    /// Into the dense cloud.
    pub cloud: CloudFrameReport,
    /// Into the octree.
    pub octree: InsertReport,
    /// Objects that were removed, since they are no longer where they were.
    pub removed: Vec<ObjectId>,
    /// Objects that have new parameters, since part of them stood in what is free space now.
    pub updated: Vec<ObjectId>,
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

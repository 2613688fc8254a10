use std::sync::Arc;

use dymlm_core::{BoundingBox, TrackId};

use crate::{BoxSource, TrackState, TrackedBox};

/// A potential mover in one frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Mover {
    /// Its track; the same from frame to frame.
    pub track_id: TrackId,
    /// Class label; `None` for what no detector reports.
    pub label: Option<Arc<str>>,
    /// The detector's confidence, of the last detection when this one is predicted; 0..=1. 1 without a label.
    pub score: f32,
    /// Whether the detector saw it in this frame, or how else it was found.
    pub source: BoxSource,
    /// Whether its track has been seen often enough to coast.
    pub state: TrackState,
    /// The box as detected, or around what was found of a predicted one, pixels.
    pub bounding_box: BoundingBox,
    /// The box that holds the mover's pixels, pixels; never smaller than `bounding_box`.
    pub corrected_box: BoundingBox,
    /// Median depth of its foreground, metres; `None` when none was found.
    pub depth: Option<f32>,
}

impl Mover {
    /// A mover whose box is not corrected yet.
    pub(crate) fn of_track(tracked: &TrackedBox) -> Self {
        Self {
            track_id: tracked.track_id,
            label: Some(Arc::clone(&tracked.label)),
            score: tracked.score,
            source: tracked.source,
            state: tracked.state,
            bounding_box: tracked.bounding_box,
            corrected_box: tracked.bounding_box,
            depth: tracked.expected_depth,
        }
    }
}

use std::sync::Arc;

use dymlm_core::{BoundingBox, TrackId};

use crate::{BoxSource, TrackState, TrackedBox};

/// A potential mover in one frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Mover {
    /// Its track's id; the same from frame to frame.
    pub track_id: TrackId,
    /// Class label; `None` for a mover that no detector reports.
    pub label: Option<Arc<str>>,
    /// The detector's confidence in this detection, or in the last one when this box is predicted; 0..=1. 1
    /// without a label.
    pub score: f32,
    /// Where its box comes from: a detection of this frame, or how else it was found.
    pub source: BoxSource,
    /// Whether its track has been seen for long enough to coast.
    pub state: TrackState,
    /// The box as detected; for a predicted mover, the box around the foreground that was found. Pixels.
    pub bounding_box: BoundingBox,
    /// The corrected box, which holds the mover's pixels; never smaller than `bounding_box`. Pixels.
    pub corrected_box: BoundingBox,
    /// Median depth of its foreground, metres; `None` when there is no foreground.
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

use std::sync::Arc;

use dymlm_core::{BoundingBox, TrackId};

use crate::{BoxSource, TrackState};

/// A potential mover in one frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Mover {
    /// Its track; the same from frame to frame.
    pub track_id: TrackId,
    /// Class label.
    pub label: Arc<str>,
    /// The detector's confidence, of the last detection when this one is predicted; 0..=1.
    pub score: f32,
    /// Whether the detector saw it in this frame.
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

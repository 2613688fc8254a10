use std::sync::Arc;

use dymlm_core::{BoundingBox, TrackId};

/// A box of one track in one frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrackedBox {
    /// The same over the life of a track, never used again after it; counts from 0.
    pub track_id: TrackId,
    /// Class label; all detections of a track have it.
    pub label: Arc<str>,
    /// The detector's confidence in this frame's detection, or in the last one when the box is predicted;
    /// 0..=1.
    pub score: f32,
    /// The box as detected, or as predicted; pixels.
    pub bounding_box: BoundingBox,
    /// The filter's estimate of the box, in which the detector's jitter is smoothed; pixels. The same as
    /// `bounding_box` when that is predicted.
    pub filtered_box: BoundingBox,
    /// Where the box comes from.
    pub source: BoxSource,
    /// Whether the track has been seen often enough to be relied upon.
    pub state: TrackState,
    /// Depth of the track's foreground as last observed, carried over into the present camera; metres. `None`
    /// when it was never given to [`BoxTracker::observe_depth`](crate::BoxTracker::observe_depth).
    pub expected_depth: Option<f32>,
}

/// Where the box of a track comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum BoxSource {
    /// A detection of this frame.
    Detected {
        /// Its index among the frame's detections.
        detection: usize,
    },
    /// The track's motion: no detection of this frame fits.
    Predicted {
        /// Time since the track's last detection, seconds.
        missed_for: f64,
    },
    /// No detector: readings in space that was free for long. [`BoxTracker`](crate::BoxTracker) gives none of
    /// these.
    FreeSpace,
}

/// How much a track is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TrackState {
    /// Seen for less than `confirm_after`.
    Tentative,
    /// Seen for `confirm_after` or longer.
    Confirmed,
}

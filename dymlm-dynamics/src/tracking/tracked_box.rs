use std::sync::Arc;

use dymlm_core::{BoundingBox, TrackId};

/// A box of one track in one frame.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrackedBox {
    /// Id of the track, which no later track gets; counted from 0.
    pub track_id: TrackId,
    /// Class label of all detections of the track.
    pub label: Arc<str>,
    /// The detector's confidence in this frame's detection, or in the last one when the box is predicted;
    /// 0..=1.
    pub score: f32,
    /// The box as detected, or as predicted; pixels.
    pub bounding_box: BoundingBox,
    /// The filter's estimate of the box, with the detector's jitter smoothed; pixels. Equals `bounding_box`
    /// when that is predicted.
    pub filtered_box: BoundingBox,
    /// Where the box comes from.
    pub source: BoxSource,
    /// Whether the track has been seen for long enough to coast.
    pub state: TrackState,
    /// Last observed depth of the track's foreground, converted to the present camera; metres. `None` when
    /// none was given to [`BoxTracker::observe_depth`](crate::BoxTracker::observe_depth).
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
    /// A prediction from the track's motion, because no detection of this frame matches.
    Predicted {
        /// Time since the track's last detection, seconds.
        missed_for: f64,
    },
    /// Readings in space that was free for long, without a detection. [`BoxTracker`](crate::BoxTracker) gives
    /// no such box.
    FreeSpace,
}

/// How far a track can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TrackState {
    /// Seen for less than `confirm_after`.
    Tentative,
    /// Seen for `confirm_after` or longer.
    Confirmed,
}

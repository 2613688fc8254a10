use dymlm_core::{ConfigError, check_range};

/// Settings of [`BoxTracker`](crate::BoxTracker).
///
/// A detection's score decides what it may do:
///
/// | score | |
/// | --- | --- |
/// | >= `high_score` | is associated first, with all tracks |
/// | >= `min_score` | is associated second, with unmatched tracks; output even if unmatched, as a new track |
/// | >= 0.1 | is associated second; output only if matched |
/// | below | is ignored |
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct TrackerConfig {
    /// Detections at or above this score are associated first; 0..=1, default 0.5 (`ByteTrack`).
    pub high_score: f32,
    /// Unmatched detections at or above this score start a track; 0..=1, default 0.25, the threshold of
    /// common detectors.
    pub min_score: f32,
    /// Least intersection over union of a track's predicted box with a detection; 0..=1, default 0.3 (SORT).
    pub min_iou: f32,
    /// Time from a track's first detection to the one that confirms it, seconds; 0..=10, default 0.03: the
    /// second detection at up to 30 Hz. (SORT confirms at the third at 30 Hz, 0.06, and does not output an
    /// unconfirmed track at all; here it only may not coast.)
    pub confirm_after: f64,
    /// How long a confirmed track without a detection is output with its predicted box, seconds; 0..=60,
    /// default 0.5; 0 = never. If not 0, it is output for at least one missed detection, if that is at most
    /// 5 s after the last one: later a prediction says nothing.
    pub max_coast: f64,
    /// How long a track without a detection is remembered, seconds; 0..=600, default 1 (`ByteTrack`'s 30
    /// frames). A value below `max_coast` counts as `max_coast`, and a value below two of the intervals at
    /// which the detector runs counts as these (60 s at most, also until the detector has run twice), so that a
    /// miss can be bridged at any rate.
    pub max_age: f64,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            high_score: 0.5,
            min_score: 0.25,
            min_iou: 0.3,
            confirm_after: 0.03,
            max_coast: 0.5,
            max_age: 1.0,
        }
    }
}

impl TrackerConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("dynamics.tracker.high_score", self.high_score.into(), 0.0..=1.0)?;
        check_range("dynamics.tracker.min_score", self.min_score.into(), 0.0..=1.0)?;
        check_range("dynamics.tracker.min_iou", self.min_iou.into(), 0.0..=1.0)?;
        check_range("dynamics.tracker.confirm_after", self.confirm_after, 0.0..=10.0)?;
        check_range("dynamics.tracker.max_coast", self.max_coast, 0.0..=60.0)?;
        check_range("dynamics.tracker.max_age", self.max_age, 0.0..=600.0)
    }
}

use dymlm_core::{ConfigError, check_range};

/// Settings of [`BoxTracker`](crate::BoxTracker).
///
/// A detection's score decides what it may do:
///
/// | score | |
/// | --- | --- |
/// | >= `high_score` | is associated first, with every track |
/// | >= `min_score` | is associated second, with the tracks left over; output in any case, starting a track when none takes it |
/// | >= `low_score` | is associated second; output only when a track takes it |
/// | below | is ignored |
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct TrackerConfig {
    /// Detections at or above this score are associated first; 0..=1, default 0.5 (`ByteTrack`).
    pub high_score: f32,
    /// Detections at or above this score start a track; 0..=1, default 0.25, the score at which common detectors
    /// cut off.
    pub min_score: f32,
    /// Detections below this score are ignored; 0..=`min_score`, default 0.1 (`ByteTrack`).
    pub low_score: f32,
    /// Least intersection over union of a track's predicted box with a detection; 0..=1, default 0.3 (SORT).
    pub min_iou: f32,
    /// The same in the second association; 0..=1, default 0.3. (`ByteTrack` asks for 0.5 at 30 Hz; at the lower
    /// frame rates of key frames true pairs overlap less.)
    pub min_iou_low_score: f32,
    /// Detections that confirm a track; 1..=1000, default 2. (SORT takes 3, at 30 Hz; there an unconfirmed track is
    /// not output at all, here it only may not coast.)
    pub min_hits: u32,
    /// How long a confirmed track without a detection is output with its predicted box, seconds; 0..=60, default
    /// 0.5; 0 = never.
    pub max_coast: f64,
    /// How long a track without a detection is remembered, seconds; 0..=600, default 1 (`ByteTrack`'s 30 frames).
    /// Never less than `max_coast`.
    pub max_age: f64,
}

impl Default for TrackerConfig {
    fn default() -> Self {
        Self {
            high_score: 0.5,
            min_score: 0.25,
            low_score: 0.1,
            min_iou: 0.3,
            min_iou_low_score: 0.3,
            min_hits: 2,
            max_coast: 0.5,
            max_age: 1.0,
        }
    }
}

impl TrackerConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("tracker.high_score", self.high_score.into(), 0.0..=1.0)?;
        check_range("tracker.min_score", self.min_score.into(), 0.0..=1.0)?;
        check_range("tracker.low_score", self.low_score.into(), 0.0..=self.min_score.into())?;
        check_range("tracker.min_iou", self.min_iou.into(), 0.0..=1.0)?;
        check_range("tracker.min_iou_low_score", self.min_iou_low_score.into(), 0.0..=1.0)?;
        check_range("tracker.min_hits", self.min_hits.into(), 1.0..=1000.0)?;
        check_range("tracker.max_coast", self.max_coast, 0.0..=60.0)?;
        check_range("tracker.max_age", self.max_age, 0.0..=600.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_low_score_is_at_most_the_least_one() {
        let config = TrackerConfig { min_score: 0.25, low_score: 0.25, ..TrackerConfig::default() };
        assert!(config.validate().is_ok());
        let config = TrackerConfig { min_score: 0.25, low_score: 0.3, ..TrackerConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "tracker.low_score");
    }
}

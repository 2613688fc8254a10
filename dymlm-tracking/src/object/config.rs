use dymlm_core::{ConfigError, check_range};

/// Settings of [`ObjectTracker`](crate::ObjectTracker).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ObjectTrackerConfig {
    /// Number of points matched with stored views in each frame, 8..=1000, default 100. Time grows with it.
    pub max_points: usize,
    /// Time without a pose after which the object is lost, seconds, 0..=60, default 0.5. So long, and for half a
    /// second at least, its motion is predicted.
    pub lost_after: f64,
    /// The object is at rest when it has moved by less than `rest_distance` and `rest_angle` for this time,
    /// seconds, 0.05..=60, default 0.8. It leaves its rest when it has moved by three times as much.
    pub rest_time: f64,
    /// Metres, 1e-4..=1, default 0.01: twice the jitter of the pose at 2 m.
    pub rest_distance: f64,
    /// Radians, 1e-3..=1, default 0.05 (3 degrees).
    pub rest_angle: f64,
    /// Standard deviation of the object's acceleration, metres per second squared, 0.01..=1000, default 3,
    /// which a hand that shakes something reaches.
    pub acceleration: f64,
    /// Standard deviation of its angular acceleration, radians per second squared, 0.01..=1000, default 8.
    pub angular_acceleration: f64,
    /// Standard deviation of the model's surface from the object's, metres, 1e-4..=1, default 0.008, as of a
    /// map's box around a bottle. Without depth, the object's points are first placed on the model's surface,
    /// and are corrected as the object turns.
    pub model_sigma: f64,
}

impl Default for ObjectTrackerConfig {
    fn default() -> Self {
        Self {
            max_points: 100,
            lost_after: 0.5,
            rest_time: 0.8,
            rest_distance: 0.01,
            rest_angle: 0.05,
            acceleration: 3.0,
            angular_acceleration: 8.0,
            model_sigma: 0.008,
        }
    }
}

impl ObjectTrackerConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("tracking.max_points", self.max_points as f64, 8.0..=1000.0)?;
        check_range("tracking.lost_after", self.lost_after, 0.0..=60.0)?;
        check_range("tracking.rest_time", self.rest_time, 0.05..=60.0)?;
        check_range("tracking.rest_distance", self.rest_distance, 1e-4..=1.0)?;
        check_range("tracking.rest_angle", self.rest_angle, 1e-3..=1.0)?;
        check_range("tracking.acceleration", self.acceleration, 0.01..=1000.0)?;
        check_range("tracking.angular_acceleration", self.angular_acceleration, 0.01..=1000.0)?;
        check_range("tracking.model_sigma", self.model_sigma, 1e-4..=1.0)
    }
}

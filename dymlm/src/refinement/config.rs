use dymlm_core::{ConfigError, check_range};

/// How far the caller's poses are trusted, compared with the planes and objects.
///
/// Each key frame's pose follows from the one before by a motion with these errors. The defaults are those of
/// RGB-D SLAM among walking people: the relative pose error over a second that Yu et al. ("DS-SLAM", IROS
/// 2018, tables II and III) report on TUM's `fr3_walking_static`.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct RefineConfig {
    /// Drift of the position, metres after a second (m / sqrt(s)), 1e-6..=10. Default 0.0102.
    pub translation_per_second: f64,
    /// Drift of the rotation, radians after a second (rad / sqrt(s)), 1e-6..=1. Default 0.269 degrees.
    pub rotation_per_second: f64,
    /// Error of the position of each frame alone, metres, 1e-6..=1. Default 0.001.
    pub translation_jitter: f64,
    /// Error of the rotation of each frame alone, radians, 1e-6..=1. Default 0.03 degrees.
    pub rotation_jitter: f64,
    /// Error of the first pose of a further session in the world of the maps: position, metres, 1e-6..=100.
    /// Default 0.05: the error of a place recognition.
    pub session_translation: f64,
    /// The same error of the rotation, radians, 1e-6..=3. Default 2 degrees.
    pub session_rotation: f64,
    /// Share of the sensor's noise that all readings of a plane in one frame have in common, so that it does
    /// not average out, 0.01..=1. Default 0.3: what is left by a camera's calibration and its steps of depth.
    pub common_noise: f64,
    /// Greatest number of rounds, each of which solves for the poses and builds the maps again, so that
    /// planes are associated at better poses: 1..=10. Default 4. Poses stay when they would move by less than
    /// the errors of each frame alone.
    pub rounds: usize,
}

impl Default for RefineConfig {
    fn default() -> Self {
        Self {
            translation_per_second: 0.0102,
            rotation_per_second: 0.269_f64.to_radians(),
            translation_jitter: 0.001,
            rotation_jitter: 0.03_f64.to_radians(),
            session_translation: 0.05,
            session_rotation: 2_f64.to_radians(),
            common_noise: 0.3,
            rounds: 4,
        }
    }
}

impl RefineConfig {
    /// # Errors
    ///
    /// The first field that is outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        check_range("refine.translation_per_second", self.translation_per_second, 1e-6..=10.0)?;
        check_range("refine.rotation_per_second", self.rotation_per_second, 1e-6..=1.0)?;
        check_range("refine.translation_jitter", self.translation_jitter, 1e-6..=1.0)?;
        check_range("refine.rotation_jitter", self.rotation_jitter, 1e-6..=1.0)?;
        check_range("refine.session_translation", self.session_translation, 1e-6..=100.0)?;
        check_range("refine.session_rotation", self.session_rotation, 1e-6..=3.0)?;
        check_range("refine.common_noise", self.common_noise, 0.01..=1.0)?;
        check_range("refine.rounds", self.rounds as f64, 1.0..=10.0)
    }

    /// Standard deviations of the rotation and of the translation (of one axis) between two key frames that
    /// are `seconds` apart.
    pub(super) fn deviations(&self, seconds: f64) -> [f64; 2] {
        let deviation = |per_second: f64, jitter: f64| {
            ((per_second * per_second * seconds + 2.0 * jitter * jitter) / 3.0).sqrt()
        };
        [
            deviation(self.rotation_per_second, self.rotation_jitter),
            deviation(self.translation_per_second, self.translation_jitter),
        ]
    }
}

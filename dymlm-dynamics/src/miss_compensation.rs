use dymlm_core::{ConfigError, check_range};

use crate::{Error, Foreground};

/// Settings of [`MissCompensator`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CompensationConfig {
    /// Largest difference between the depth of the foreground and the one expected of the track, metres; 0..=10,
    /// default 0.2: what the median of a person's surface moves by when the box is cut differently.
    pub depth_tolerance: f32,
    /// Speed of movers: the tolerance grows by it with the time since the last detection, metres per second;
    /// 0..=100, default 0.7: an indoor walk.
    pub mover_speed: f32,
    /// Least share of the box's samples that must be foreground; 0..=1, default 0.15: a person that raises the arms
    /// fills a third.
    pub min_fill: f32,
}

impl Default for CompensationConfig {
    fn default() -> Self {
        Self { depth_tolerance: 0.2, mover_speed: 0.7, min_fill: 0.15 }
    }
}

impl CompensationConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        check_range("compensation.depth_tolerance", self.depth_tolerance.into(), 0.0..=10.0)?;
        check_range("compensation.mover_speed", self.mover_speed.into(), 0.0..=100.0)?;
        check_range("compensation.min_fill", self.min_fill.into(), 0.0..=1.0)
    }
}

/// Decides whether a track that the detector missed is still where its motion puts it: paper section III-A,
/// "missed detection compensation".
///
/// The predicted box must hold a foreground that fills a part of it, at about the depth of the track. A track whose
/// depth was never known, or a box in which nothing has a depth, proves nothing and is not masked.
///
/// ```
/// use dymlm_dynamics::{CompensationConfig, Foreground, MissCompensator};
///
/// let compensator = MissCompensator::new(CompensationConfig::default())?;
/// assert!(!compensator.is_still_there(&Foreground::new(), Some(2.0), 0.1));
/// # Ok::<(), dymlm_dynamics::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct MissCompensator {
    config: CompensationConfig,
}

impl MissCompensator {
    /// Makes a compensator.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: CompensationConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self { config })
    }

    /// Whether the foreground found in a predicted box is the track's, whose depth should be `expected_depth` metres
    /// and which was last detected `missed_for` seconds ago.
    pub fn is_still_there(
        &self,
        foreground: &Foreground,
        expected_depth: Option<f32>,
        missed_for: f64,
    ) -> bool {
        let tolerance = self.config.depth_tolerance + self.config.mover_speed * missed_for as f32;
        match (foreground.depth(), expected_depth) {
            (Some(found), Some(expected)) => {
                (found - expected).abs() <= tolerance && foreground.fill() >= self.config.min_fill
            }
            _ => false,
        }
    }
}

use dymlm_core::{ConfigError, check_range};
use dymlm_geometry::SegmentationConfig;

/// Settings of [`Parameterizer`](crate::Parameterizer).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ParameterizationConfig {
    /// Detections of a lower score are passed over, 0..=1. Default 0.25: detectors report none below.
    pub min_score: f32,
    /// Pixels of a box that are looked at, at most (a grid of them): 64..=1000000. Default 1600.
    pub max_samples: usize,
    /// Fewest samples of an object, 4..=100000. Default 12.
    pub min_samples: usize,
    /// Least share of the box's samples (of those a sensor could read or not) that must be the object, 0..=1. Default 0.04:
    /// less is a rest of something else.
    pub min_fill: f32,
    /// How far around the box is looked, as a share of its longer side, 0..=1. Default 0.15; at least 6 pixels. What a
    /// cluster does outside tells things from their background.
    pub margin: f32,
    /// Labels of what people sit or lie on: when a mover hides much of it, the rest is at the mover's depth. What else is hidden
    /// may be anywhere behind. Default: bed, bench, bicycle, chair, couch, motorcycle, toilet.
    pub seats: Vec<String>,
    /// How far from a supporting plane a point counts as its, metres, 0..=0.2, before the noise is added. Default 0.006.
    pub plane_tolerance: f64,
    /// Standard deviations of the depth noise that are added, 0..=10. Default 1: samples are means of 9 readings or more.
    pub plane_sigmas: f64,
    /// Largest angle between a supporting plane's normal and the camera's upward direction, radians, 0..=pi/2. Default
    /// 0.9: cameras are carried upright, give or take.
    pub max_support_tilt: f64,
    /// Largest angle between a supporting plane's normal and the vertical, once that is known, radians, 0..=pi/2. Default
    /// 0.14 (8 degrees): what things stand on is level; what slopes was laid through edges and rows of things.
    pub max_support_slope: f64,
    /// Farthest that an object's lowest point may be above the plane that it stands on, metres, 0..=2. Default 0.08. When
    /// its lower side is hidden, as far as its size prior allows.
    pub max_support_gap: f64,
}

const SEATS: [&str; 7] = ["bed", "bench", "bicycle", "chair", "couch", "motorcycle", "toilet"];

impl Default for ParameterizationConfig {
    fn default() -> Self {
        Self {
            min_score: 0.25,
            max_samples: 1600,
            min_samples: 12,
            min_fill: 0.04,
            margin: 0.15,
            seats: SEATS.map(String::from).to_vec(),
            plane_tolerance: 0.006,
            plane_sigmas: 1.0,
            max_support_tilt: 0.9,
            max_support_slope: 0.14,
            max_support_gap: 0.08,
        }
    }
}

impl ParameterizationConfig {
    /// How the thing in a box is found.
    pub(super) fn segmentation(&self) -> SegmentationConfig {
        let mut config = SegmentationConfig::default();
        config.max_samples = self.max_samples;
        config.margin_share = self.margin;
        config
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("objects.parameterization.min_score", self.min_score.into(), 0.0..=1.0)?;
        check_range("objects.parameterization.max_samples", self.max_samples as f64, 64.0..=1e6)?;
        check_range("objects.parameterization.min_samples", self.min_samples as f64, 4.0..=1e5)?;
        check_range("objects.parameterization.min_fill", self.min_fill.into(), 0.0..=1.0)?;
        check_range("objects.parameterization.margin", self.margin.into(), 0.0..=1.0)?;
        check_range("objects.parameterization.plane_tolerance", self.plane_tolerance, 0.0..=0.2)?;
        check_range("objects.parameterization.plane_sigmas", self.plane_sigmas, 0.0..=10.0)?;
        let right_angle = std::f64::consts::FRAC_PI_2;
        check_range("objects.parameterization.max_support_tilt", self.max_support_tilt, 0.0..=right_angle)?;
        check_range("objects.parameterization.max_support_slope", self.max_support_slope, 0.0..=right_angle)?;
        check_range("objects.parameterization.max_support_gap", self.max_support_gap, 0.0..=2.0)
    }
}

use dymlm_core::vector3::norm;
use dymlm_core::{ConfigError, check_range};

/// Settings of the step from detections to boxes in space.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ParameterizationConfig {
    /// Detections of a lower score are ignored, 0..=1. Default 0.25: common detectors report none below.
    pub min_score: f32,
    /// Labels of things on which people sit or lie: when a mover occludes much of such a thing, the visible
    /// rest is at the mover's depth. Other occluded things may be at any depth behind. Default: bed, bench,
    /// bicycle, chair, couch, motorcycle, toilet.
    pub seats: Vec<String>,
    /// Distance up to which points belong to a supporting plane, metres, 0..=0.2; a reading's noise is added.
    /// Default 0.006.
    pub plane_tolerance: f64,
    /// The upward direction in the world, of any length. Default none: it is learnt from the planes on which
    /// things rest, and nothing depends on it until then.
    pub up: Option<[f64; 3]>,
    /// Largest angle between a supporting plane's normal and the vertical, once that is known, radians,
    /// 0.01..=pi/2. Default 0.14 (8 degrees): things stand on level planes; sloping planes were fitted across
    /// the edges of things or rows of things. The normals of planes themselves err by tenths of a degree:
    /// with less than 0.01 (0.6 degrees) no plane counts as level, and no two votes for the vertical agree.
    pub max_support_slope: f64,
    /// Largest distance of an object's lowest point above the plane on which it stands, metres, 0..=2.
    /// Default 0.08. When the object's lower end is occluded, the usual height of its label if that is
    /// larger.
    pub max_support_gap: f64,
}

const SEATS: [&str; 7] = ["bed", "bench", "bicycle", "chair", "couch", "motorcycle", "toilet"];

/// Things whose least height is at most this many plane tolerances may lie on a plane without showing in
/// depth.
const FLAT_TOLERANCES: f64 = 2.0;

impl Default for ParameterizationConfig {
    fn default() -> Self {
        Self {
            min_score: 0.25,
            seats: SEATS.map(String::from).to_vec(),
            plane_tolerance: 0.006,
            up: None,
            max_support_slope: 0.14,
            max_support_gap: 0.08,
        }
    }
}

impl ParameterizationConfig {
    /// Things whose least height is at most this, metres, may lie on a plane without showing in depth.
    pub(crate) fn flat_height(&self) -> f64 {
        FLAT_TOLERANCES * self.plane_tolerance
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("objects.parameterization.min_score", self.min_score.into(), 0.0..=1.0)?;
        check_range("objects.parameterization.plane_tolerance", self.plane_tolerance, 0.0..=0.2)?;
        let right_angle = std::f64::consts::FRAC_PI_2;
        if let Some(up) = self.up {
            check_range("the length of objects.parameterization.up", norm(up), 1e-9..=1e9)?;
        }
        check_range(
            "objects.parameterization.max_support_slope",
            self.max_support_slope,
            0.01..=right_angle,
        )?;
        check_range("objects.parameterization.max_support_gap", self.max_support_gap, 0.0..=2.0)
    }
}

use dymlm_core::{ConfigError, check_range};

/// Settings that decide which detected planes reach the map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct FilterConfig {
    /// Nearest mean depth of a plane, metres, 0..=100. Default 0.3.
    pub min_depth: f64,
    /// Farthest mean depth of a plane, metres, 0.1..=100. Default 4.6: what is mapped ends at 4 m, see
    /// `max_sample_depth`; `min_area` counts only that.
    pub max_depth: f64,
    /// Smallest share of a segment's pixels that are inliers, 0..=1. Default 0.7.
    pub min_inlier_ratio: f64,
    /// Largest share of a segment's pixels that lie in the movers' boxes, 0..=1. Default 1, no limit: the mask has taken the
    /// movers' pixels out already, and what is left in a box is mostly what stands behind. With 0.7 a map of people who
    /// sit lacks the chairs and the walls around them, and gains nothing (recall of faces on the eight synthetic
    /// sequences 75 instead of 87 %, precision the same). Set it where masks leave parts of movers.
    pub max_mover_overlap: f64,
    /// Smallest area, square metres, 0..=100. Default 0.05: a chair's seat of which a person leaves a
    /// quarter; smaller ones are mostly pieces of round things.
    pub min_area: f64,
    /// Largest standard deviation of the normal's direction, degrees, 0.01..=90. Default 3.
    pub max_angle_deviation_deg: f64,
}

impl Default for FilterConfig {
    fn default() -> Self {
        Self {
            min_depth: 0.3,
            max_depth: 4.6,
            min_inlier_ratio: 0.7,
            max_mover_overlap: 1.0,
            min_area: 0.05,
            max_angle_deviation_deg: 3.0,
        }
    }
}

impl FilterConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("planes.filter.min_depth", self.min_depth, 0.0..=100.0)?;
        check_range("planes.filter.max_depth", self.max_depth, self.min_depth.max(0.1)..=100.0)?;
        check_range("planes.filter.min_inlier_ratio", self.min_inlier_ratio, 0.0..=1.0)?;
        check_range("planes.filter.max_mover_overlap", self.max_mover_overlap, 0.0..=1.0)?;
        check_range("planes.filter.min_area", self.min_area, 0.0..=100.0)?;
        check_range("planes.filter.max_angle_deviation_deg", self.max_angle_deviation_deg, 0.01..=90.0)
    }
}

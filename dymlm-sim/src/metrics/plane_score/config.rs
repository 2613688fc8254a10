use dymlm_core::{ConfigError, check_range};

/// What counts as the same plane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PlaneScoreConfig {
    /// Visible area of a face (with its reliefs) from which on a map is asked for it, square metres, 0..=1000, default
    /// 0.08: 3000 pixels of a 640x480 Kinect at 2.7 m, the support that plane extraction wants.
    pub min_area: f64,
    /// Visible area counts towards `min_area` where a square of this side around it is seen, by three quarters at least,
    /// metres, 0..=10, default 0.1: no plane can be fitted to the edge of a board. 0: all counts.
    pub min_width: f64,
    /// Side of the cells that planes are divided into, metres, 0.002..=1, default 0.02.
    pub cell: f64,
    /// Farthest that a plane may lie from a face that it stands for, metres, 0.001..=1, default 0.05: the distance at
    /// which planes are associated.
    pub max_offset: f64,
    /// Largest angle between a plane and a face that it stands for, degrees, 0.1..=45, default 10: the angle at which planes
    /// are associated.
    pub max_angle_degrees: f64,
    /// Share of a face's visible area that the planes matching it must cover for it to count as found, 0..=1, default
    /// 0.25.
    pub min_coverage: f64,
    /// Share of a plane's area from which on a face is a substantial part of it, 0..=1, default 0.2; an area of
    /// `min_area` is substantial in any case.
    pub merged_share: f64,
}

impl Default for PlaneScoreConfig {
    fn default() -> Self {
        Self {
            min_area: 0.08,
            min_width: 0.1,
            cell: 0.02,
            max_offset: 0.05,
            max_angle_degrees: 10.0,
            min_coverage: 0.25,
            merged_share: 0.2,
        }
    }
}

impl PlaneScoreConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("plane_score.min_area", self.min_area, 0.0..=1000.0)?;
        check_range("plane_score.min_width", self.min_width, 0.0..=10.0)?;
        check_range("plane_score.cell", self.cell, 0.002..=1.0)?;
        check_range("plane_score.max_offset", self.max_offset, 0.001..=1.0)?;
        check_range("plane_score.max_angle_degrees", self.max_angle_degrees, 0.1..=45.0)?;
        check_range("plane_score.min_coverage", self.min_coverage, 0.0..=1.0)?;
        check_range("plane_score.merged_share", self.merged_share, 0.0..=1.0)
    }
}

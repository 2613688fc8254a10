use dymlm_core::{ConfigError, check_range};

use crate::association::AssociationConfig;

/// Settings of the plane map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct PlaneMapConfig {
    /// The test whether a detected plane is one of the map's, and whether two of the map are one.
    pub association: AssociationConfig,
    /// Side of the voxels in which a plane's inliers are stored, metres, 0.005..=1. Default 0.025: the
    /// spacing of samples at 3.3 m.
    pub voxel_size: f64,
    /// Least number of key frames that must have seen a plane before it is confirmed, and one more when a key
    /// frame has looked there without finding it, 1..=1000. Default 2: what only one has seen may be a
    /// person's back, and a facet of a pillar is not found again from the next place. Conclusions that are
    /// not withdrawn ask for one more in any case: that two planes are one across an occluded gap, and that
    /// an object stands on a plane.
    pub min_observations: u32,
    /// Least share of the key frames that looked at a plane's centroid, near enough to find the plane, that
    /// must have seen it to confirm it, 0..=1; of those from one place, where the camera rests, no more than
    /// 20 count. Default 0.12: a plane fitted across an edge appears in a frame or two of the many that look
    /// there.
    pub min_observation_share: f64,
    /// Largest hole of a boundary that is filled, square metres, 0..=100. Default 0.02: a cup on a table.
    pub max_hole_area: f64,
    /// A boundary's corners are kept when they are farther than this from the line between their neighbours,
    /// metres, 0..=1. Default 0.02.
    pub boundary_tolerance: f64,
}

impl Default for PlaneMapConfig {
    fn default() -> Self {
        Self {
            association: AssociationConfig::default(),
            voxel_size: 0.025,
            min_observations: 2,
            min_observation_share: 0.12,
            max_hole_area: 0.02,
            boundary_tolerance: 0.02,
        }
    }
}

impl PlaneMapConfig {
    /// Least number of key frames that must have seen a plane, of which others have missed it so often: one
    /// more if any have.
    pub(crate) fn least_observations(&self, missed: u32) -> u32 {
        self.min_observations.saturating_add(u32::from(missed > 0))
    }

    /// Least number of key frames for conclusions that are not withdrawn.
    pub(crate) fn lasting_observations(&self) -> u32 {
        self.min_observations.saturating_add(1)
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        self.association.validate()?;
        check_range("planes.map.voxel_size", self.voxel_size, 0.005..=1.0)?;
        check_range("planes.map.min_observations", f64::from(self.min_observations), 1.0..=1000.0)?;
        check_range("planes.map.min_observation_share", self.min_observation_share, 0.0..=1.0)?;
        check_range("planes.map.max_hole_area", self.max_hole_area, 0.0..=100.0)?;
        check_range("planes.map.boundary_tolerance", self.boundary_tolerance, 0.0..=1.0)
    }
}

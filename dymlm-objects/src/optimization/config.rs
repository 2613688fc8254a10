use dymlm_core::{ConfigError, check_range};
use dymlm_geometry::IsolationForestConfig;

/// Settings of the update of an object by its observations.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct UpdateConfig {
    /// Side of the voxels of an object's cloud, metres, 0.001..=0.1. Default 0.01.
    pub voxel_size: f64,
    /// Most voxels of an object; with more, their side doubles. 64..=1000000, default 2500.
    pub max_voxels: usize,
    /// The isolation forest. Default 50 trees (Liu 2008: path lengths converge between 50 and 100), other
    /// settings as published.
    pub isolation_forest: IsolationForestConfig,
    /// Observations needed to confirm an object, 1..=1000. Default 3.
    pub min_observations: u32,
    /// Share of the frames with the object in view that must have detected it to confirm it, 0..=1, if its
    /// projection matches the detector's boxes with a mean intersection over union of 0.4; less when they match
    /// better, and none for a perfect match. With a match below 0.4 an object is not confirmed. Default 0.25:
    /// detectors find most of what is in view. A camera that looks on from one place counts for at most twenty
    /// frames.
    pub min_detected_share: f64,
    /// Frames that must have looked through an object for it to be removed, 1..=1000; they must also
    /// outnumber its observations. Default 3.
    pub min_looked_through: u32,
}

impl Default for UpdateConfig {
    fn default() -> Self {
        let mut isolation_forest = IsolationForestConfig::default();
        isolation_forest.trees = 50;
        Self {
            voxel_size: 0.01,
            max_voxels: 2500,
            isolation_forest,
            min_observations: 3,
            min_detected_share: 0.25,
            min_looked_through: 3,
        }
    }
}

impl UpdateConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("objects.update.voxel_size", self.voxel_size, 0.001..=0.1)?;
        check_range("objects.update.max_voxels", self.max_voxels as f64, 64.0..=1e6)?;
        check_range("objects.update.min_observations", self.min_observations.into(), 1.0..=1000.0)?;
        check_range("objects.update.min_detected_share", self.min_detected_share, 0.0..=1.0)?;
        check_range("objects.update.min_looked_through", self.min_looked_through.into(), 1.0..=1000.0)
    }
}

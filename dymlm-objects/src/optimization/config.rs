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
    /// Voxels of an object, at most; with more their side doubles. 64..=1000000, default 2500.
    pub max_voxels: usize,
    /// Share of the usual number of observations a voxel (the upper quartile) that a voxel needs to count, 0..=1. Default
    /// 0.12: what is seen now and then at the rim is noise.
    pub min_voxel_share: f64,
    /// The isolation forest. Default 50 trees (Liu 2008: path lengths settle between 50 and 100), else as published.
    pub isolation_forest: IsolationForestConfig,
    /// Fewest voxels that a forest is grown on, 8..=100000. Default 32.
    pub min_forest_voxels: usize,
    /// Share of the cloud that is left out at each end of each axis before the box is laid, 0..=0.2. Default 0.01.
    pub trim: f64,
    /// By what factor an object may exceed its size prior, 1..=10. Default 1.3.
    pub prior_slack: f64,
    /// Views of an object that are kept to judge new parameters by, 1..=1000. Default 12.
    pub max_key_views: usize,
    /// By how much the mean projection `IoU` over the key views may fall with new parameters, 0..=1. Default 0.05: below that
    /// it is the detector's jitter.
    pub max_iou_loss: f64,
    /// After so many refusals in a row new parameters are accepted all the same, 1..=1000. Default 5: what comes out of the
    /// data again and again is right, and the old ones were fitted to one view.
    pub max_refusals: u32,
    /// An object is parameterized anew when its observations have grown by this share since, 0..=10. Default 0.2; always
    /// while there are few.
    pub growth: f64,
    /// Observations that make an object believed, 1..=1000. Default 3.
    pub min_observations: u32,
    /// Share of the frames in view that must have detected an object for it to be believed, 0..=1. Default 0.25:
    /// detectors find most of what is in view.
    pub min_detected_share: f64,
    /// Frames that must have looked through an object, beyond its observations, to remove it, 1..=1000. Default 3.
    pub min_looked_through: u32,
}

impl Default for UpdateConfig {
    fn default() -> Self {
        let mut isolation_forest = IsolationForestConfig::default();
        isolation_forest.trees = 50;
        Self {
            voxel_size: 0.01,
            max_voxels: 2500,
            min_voxel_share: 0.12,
            isolation_forest,
            min_forest_voxels: 32,
            trim: 0.01,
            prior_slack: 1.3,
            max_key_views: 12,
            max_iou_loss: 0.05,
            max_refusals: 5,
            growth: 0.2,
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
        check_range("objects.update.min_voxel_share", self.min_voxel_share, 0.0..=1.0)?;
        check_range("objects.update.min_forest_voxels", self.min_forest_voxels as f64, 8.0..=1e5)?;
        check_range("objects.update.trim", self.trim, 0.0..=0.2)?;
        check_range("objects.update.prior_slack", self.prior_slack, 1.0..=10.0)?;
        check_range("objects.update.max_key_views", self.max_key_views as f64, 1.0..=1000.0)?;
        check_range("objects.update.max_iou_loss", self.max_iou_loss, 0.0..=1.0)?;
        check_range("objects.update.max_refusals", self.max_refusals.into(), 1.0..=1000.0)?;
        check_range("objects.update.growth", self.growth, 0.0..=10.0)?;
        check_range("objects.update.min_observations", self.min_observations.into(), 1.0..=1000.0)?;
        check_range("objects.update.min_detected_share", self.min_detected_share, 0.0..=1.0)?;
        check_range("objects.update.min_looked_through", self.min_looked_through.into(), 1.0..=1000.0)
    }
}

/// When two objects of the map are one.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MergeConfig {
    /// Least intersection over union of the boxes, 0..=1, when the labels are the same. Default 0.2.
    pub min_iou: f64,
    /// Or least share of the smaller box that lies in the larger one, 0..=1. Default 0.5.
    pub min_inside: f64,
    /// With other labels both must be at least this, 0..=1. Default 0.4: a cup on a book stays a cup.
    pub min_iou_other_label: f64,
    /// Whatever else, boxes with the same label that overlap by this are one, 0..=1. Default 0.25: solid things do not
    /// stand in each other.
    pub solid_iou: f64,
    /// The same with other labels, 0..=1. Default 0.5: detectors report one thing under two names at once.
    pub solid_iou_other_label: f64,
    /// Largest share of the less observed object's observations that were in one frame with the other's, 0..=1. Default
    /// 0.2: what is often seen side by side are two things.
    pub max_together: f64,
}

impl Default for MergeConfig {
    fn default() -> Self {
        Self {
            min_iou: 0.2,
            min_inside: 0.5,
            min_iou_other_label: 0.4,
            solid_iou: 0.25,
            solid_iou_other_label: 0.5,
            max_together: 0.2,
        }
    }
}

impl MergeConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("objects.merging.min_iou", self.min_iou, 0.0..=1.0)?;
        check_range("objects.merging.min_inside", self.min_inside, 0.0..=1.0)?;
        check_range("objects.merging.min_iou_other_label", self.min_iou_other_label, 0.0..=1.0)?;
        check_range("objects.merging.solid_iou", self.solid_iou, 0.0..=1.0)?;
        check_range("objects.merging.solid_iou_other_label", self.solid_iou_other_label, 0.0..=1.0)?;
        check_range("objects.merging.max_together", self.max_together, 0.0..=1.0)
    }
}

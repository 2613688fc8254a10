use dymlm_core::{ConfigError, check_range};

use super::CentroidTest;

/// Settings of the association of detections with objects.
///
/// A pair passes when the projection test passes AND one of three other tests does: the box predicted from
/// the object's motion in the image, shared points, the centroid (paper IV-B).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct AssociationConfig {
    /// Least intersection over union of the projected and the detected box, 0..=1. Default 0.2: the first
    /// estimates of small things are twice the true size.
    pub min_projection_iou: f64,
    /// Least intersection over union of the predicted and the detected box, 0..=1. Default 0.4.
    pub min_motion_iou: f64,
    /// Longest time over which a box is predicted, seconds, 0..=100; with a slower detector, one and a half
    /// of its intervals. Default 0.5.
    pub max_motion_gap: f64,
    /// Least share of the observation's points that the object also has, 0..=1. Default 0.35.
    pub min_shared: f64,
    /// The test of the centroid. Default [`CentroidTest::Prediction`].
    pub centroid_test: CentroidTest,
    /// Probability that the test of the centroid rejects a true pair, 1e-6..=0.5. Default 0.01: a false
    /// rejection costs a duplicate.
    pub alpha: f64,
    /// Cost of a pair with different labels, 0..=10, in units of a test's greatest value. Default 0.3:
    /// detectors confuse classes, but of two pairs the one with equal labels is preferred.
    pub label_cost: f64,
}

impl Default for AssociationConfig {
    fn default() -> Self {
        Self {
            min_projection_iou: 0.2,
            min_motion_iou: 0.4,
            max_motion_gap: 0.5,
            min_shared: 0.35,
            centroid_test: CentroidTest::Prediction,
            alpha: 0.01,
            label_cost: 0.3,
        }
    }
}

impl AssociationConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("objects.association.min_projection_iou", self.min_projection_iou, 0.0..=1.0)?;
        check_range("objects.association.min_motion_iou", self.min_motion_iou, 0.0..=1.0)?;
        check_range("objects.association.max_motion_gap", self.max_motion_gap, 0.0..=100.0)?;
        check_range("objects.association.min_shared", self.min_shared, 0.0..=1.0)?;
        check_range("objects.association.alpha", self.alpha, 1e-6..=0.5)?;
        check_range("objects.association.label_cost", self.label_cost, 0.0..=10.0)
    }
}

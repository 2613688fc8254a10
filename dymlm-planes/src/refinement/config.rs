use dymlm_core::{ConfigError, check_range};

/// Settings of the robust refit of extracted planes.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct RefinementConfig {
    /// Rounds of reweighting before the last fit, 0..=20. Default 1: the extraction is a good start, and each round
    /// costs half a millisecond.
    pub iterations: usize,
    /// Readings farther off than this many standard deviations weigh nothing while fitting, 1..=100. Default 4.685:
    /// Tukey's biweight then keeps 95 % of the efficiency of least squares on clean data.
    pub tukey_width: f64,
    /// Readings within this many standard deviations are inliers, 1..=10. Default 3.
    pub inlier_width: f64,
    /// Neighbouring readings share one error, this many of them, 1..=1000. Default 9: a structured-light camera
    /// matches windows of the image. It scales the covariance and nothing else.
    pub correlated_pixels: f64,
    /// Every how many pixels along rows and columns the plane's patch and its edge are sampled, at 640 pixels of width,
    /// 1..=32. Default 4: 3 cm at 4 m.
    pub sample_stride: usize,
    /// Farthest depth that counts as the plane's patch, metres, 0.1..=100. Default 4, as in the cloud: what is read beyond
    /// it helps to fit the plane and is not mapped.
    pub max_sample_depth: f64,
    /// Share of the 5x5 pixels around an edge point that must belong to the plane, 0..=1. Default 0.32: a corner of 90
    /// degrees keeps 9 of 25, a speck of flying pixels less.
    pub min_edge_fill: f64,
}

impl Default for RefinementConfig {
    fn default() -> Self {
        Self {
            iterations: 1,
            tukey_width: 4.685,
            inlier_width: 3.0,
            correlated_pixels: 9.0,
            sample_stride: 4,
            max_sample_depth: 4.0,
            min_edge_fill: 0.32,
        }
    }
}

impl RefinementConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("planes.refinement.iterations", self.iterations as f64, 0.0..=20.0)?;
        check_range("planes.refinement.tukey_width", self.tukey_width, 1.0..=100.0)?;
        check_range("planes.refinement.inlier_width", self.inlier_width, 1.0..=10.0)?;
        check_range("planes.refinement.correlated_pixels", self.correlated_pixels, 1.0..=1000.0)?;
        check_range("planes.refinement.sample_stride", self.sample_stride as f64, 1.0..=32.0)?;
        check_range("planes.refinement.max_sample_depth", self.max_sample_depth, 0.1..=100.0)?;
        check_range("planes.refinement.min_edge_fill", self.min_edge_fill, 0.0..=1.0)
    }
}

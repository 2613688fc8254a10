use dymlm_core::{ConfigError, check_range};

/// Settings of [`BoxSegmenter`](crate::BoxSegmenter): which readings it samples.
///
/// Lengths in pixels are those of an image of 640x480; in other images they grow with
/// [`size_scale`](dymlm_core::PinholeCamera::size_scale).
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SegmentationConfig {
    /// Least distance between samples, pixels, 1..=64. Default 1.
    pub spacing: f32,
    /// Most samples of a box and its margin, 16..=1000000: the spacing grows until there are no more, but
    /// for a row and a column of them. Default 20000.
    pub max_samples: usize,
    /// How far around the box samples are taken, pixels, 0..=640. Default 6.
    pub margin: f32,
    /// The margin as a share of the box's longer side, 0..=1; the greater of the two margins counts. Default
    /// 0.15.
    pub margin_share: f32,
    /// Whether a sample is the mean of the readings around its pixel rather than that reading alone. Default
    /// true.
    pub is_smoothed: bool,
    /// Radius of DBSCAN in depth, in addition to what noise and slope require, metres, 0..=1. Default 0.02;
    /// single readings of a coarse grid need less.
    pub eps_depth: f32,
}

impl Default for SegmentationConfig {
    fn default() -> Self {
        Self {
            spacing: 1.0,
            max_samples: 20_000,
            margin: 6.0,
            margin_share: 0.15,
            is_smoothed: true,
            eps_depth: 0.02,
        }
    }
}

impl SegmentationConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("segmentation.spacing", self.spacing.into(), 1.0..=64.0)?;
        check_range("segmentation.max_samples", self.max_samples as f64, 16.0..=1e6)?;
        check_range("segmentation.margin", self.margin.into(), 0.0..=640.0)?;
        check_range("segmentation.margin_share", self.margin_share.into(), 0.0..=1.0)?;
        check_range("segmentation.eps_depth", self.eps_depth.into(), 0.0..=1.0)
    }
}

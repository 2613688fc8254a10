use dymlm_core::{ConfigError, check_range};

use super::fhog::CELL;

/// Settings of [`KcfTracker`](crate::KcfTracker).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct KcfConfig {
    /// Side of the search window as a multiple of the target's, 1.2..=8, default 1.8: with Henriques' 2.5, a
    /// tracker of crossing pedestrians takes in passers-by and follows them. A target that moves by more than
    /// about (padding - 1) / 2 of its size between updates leaves the window.
    pub padding: f32,
    /// Longer side of the template to which the window is resampled, pixels, 16..=512, default 128. Time
    /// grows with its square.
    pub template_size: usize,
}

impl Default for KcfConfig {
    fn default() -> Self {
        Self { padding: 1.8, template_size: 128 }
    }
}

impl KcfConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("kcf.padding", self.padding.into(), 1.2..=8.0)?;
        check_range("kcf.template_size", self.template_size as f64, 16.0..=512.0)
    }
}

/// Published settings that need no change: those of the authors' own C++ program (Faro, Bailer, Henriques,
/// 2015) for histograms of gradients. They are for videos in which the target changes little between
/// frames; the paper's table 2 differs in two of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Published {
    /// Side of a gradient cell, pixels of the template.
    pub(super) cell: usize,
    /// Width of the Gaussian kernel, in units of the features.
    pub(super) kernel_sigma: f32,
    /// Weight of each new view in the model.
    pub(super) learning_rate: f32,
    /// Width of the wanted response as a share of the target's size.
    pub(super) output_sigma: f32,
}

pub(super) const PUBLISHED: Published =
    Published { cell: CELL, kernel_sigma: 0.6, learning_rate: 0.012, output_sigma: 0.125 };

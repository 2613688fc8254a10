use dymlm_core::{ConfigError, check_range};

/// What [`KcfTracker`](crate::KcfTracker) sees of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum KcfFeatures {
    /// Felzenszwalb's 31 channels of oriented gradients a cell, and the cell's mean intensity.
    #[default]
    HogAndIntensity,
    /// Felzenszwalb's 31 channels of oriented gradients a cell.
    Hog,
    /// The grey value of each pixel of the template, one channel. Faster, and easily misled by light.
    Intensity,
}

/// Settings of [`KcfTracker`](crate::KcfTracker). The defaults are those of Henriques 2015 and its published
/// multi-scale variant for gradient features, but for the window.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct KcfConfig {
    /// What is seen of the image. Default [`KcfFeatures::HogAndIntensity`].
    pub features: KcfFeatures,
    /// Side of the search window as a multiple of the target's, 1.2..=8, default 1.8: on crossing pedestrians Henriques'
    /// 2.5 takes in passers-by and follows them. A target that moves by more than about (padding - 1) / 2 of its size
    /// between updates leaves the window.
    pub padding: f32,
    /// Longer side of the template to which the window is resampled, pixels, 16..=512, default 128. Time grows with its
    /// square.
    pub template_size: usize,
    /// Side of a cell of gradients, pixels of the template, 2..=16, default 4. Intensity alone has cells of 1.
    pub cell_size: usize,
    /// Width of the Gaussian kernel, in units of the features, 0.01..=10, default 0.6.
    pub kernel_sigma: f32,
    /// Weight of the regularization lambda, 1e-9..=1, default 1e-4.
    pub regularization: f32,
    /// Share of each new view in the model, 0..=1, default 0.012. 0 = the first view is kept.
    pub learning_rate: f32,
    /// Width of the wanted response as a share of the target's size, 0.01..=1, default 0.125.
    pub output_sigma: f32,
    /// Ratio between neighbouring scales that are tried, 1.001..=2, default 1.05.
    pub scale_step: f32,
    /// Number of scales tried to each side of the last one, 0..=8, default 1; 0 = the size never changes.
    pub scales: usize,
    /// Factor on the response at another scale than the last one, for each step, 0.5..=1, default 0.98: the size
    /// changes only when that clearly fits better.
    pub scale_weight: f32,
    /// Least peak-to-sidelobe ratio at which a view is learned, 0..=100, default 5. Below it the target may be
    /// hidden, and what hides it must not be learned. 0 = always.
    pub min_learning_ratio: f32,
}

impl Default for KcfConfig {
    fn default() -> Self {
        Self {
            features: KcfFeatures::default(),
            padding: 1.8,
            template_size: 128,
            cell_size: 4,
            kernel_sigma: 0.6,
            regularization: 1e-4,
            learning_rate: 0.012,
            output_sigma: 0.125,
            scale_step: 1.05,
            scales: 1,
            scale_weight: 0.98,
            min_learning_ratio: 5.0,
        }
    }
}

impl KcfConfig {
    /// The published settings for raw intensity (Henriques 2015, table 2): sigma 0.2, learning rate 0.075, output
    /// sigma 0.1.
    pub fn intensity() -> Self {
        Self {
            features: KcfFeatures::Intensity,
            kernel_sigma: 0.2,
            learning_rate: 0.075,
            output_sigma: 0.1,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("kcf.padding", self.padding.into(), 1.2..=8.0)?;
        check_range("kcf.template_size", self.template_size as f64, 16.0..=512.0)?;
        check_range("kcf.cell_size", self.cell_size as f64, 2.0..=16.0)?;
        check_range("kcf.kernel_sigma", self.kernel_sigma.into(), 0.01..=10.0)?;
        check_range("kcf.regularization", self.regularization.into(), 1e-9..=1.0)?;
        check_range("kcf.learning_rate", self.learning_rate.into(), 0.0..=1.0)?;
        check_range("kcf.output_sigma", self.output_sigma.into(), 0.01..=1.0)?;
        check_range("kcf.scale_step", self.scale_step.into(), 1.001..=2.0)?;
        check_range("kcf.scales", self.scales as f64, 0.0..=8.0)?;
        check_range("kcf.scale_weight", self.scale_weight.into(), 0.5..=1.0)?;
        check_range("kcf.min_learning_ratio", self.min_learning_ratio.into(), 0.0..=100.0)
    }

    /// Side of a cell, pixels of the template.
    pub(super) fn cell(&self) -> usize {
        match self.features {
            KcfFeatures::Intensity => 1,
            KcfFeatures::Hog | KcfFeatures::HogAndIntensity => self.cell_size,
        }
    }
}

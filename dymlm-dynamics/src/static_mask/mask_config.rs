use dymlm_core::{ConfigError, check_range};

/// Which pixels of a mover's box are masked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum MaskMode {
    /// Everything inside the corrected box, as in the paper.
    Box,
    /// Only the pixels connected in depth to the foreground, and a rim around them.
    #[default]
    Silhouette,
}

/// Settings of the static mask.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MaskConfig {
    /// Which pixels of a box are masked; default [`MaskMode::Silhouette`].
    pub mode: MaskMode,
    /// Width of the rim masked around a silhouette, in pixels of an image of 640x480 (other images: in
    /// proportion); 0..=64, default 3: depth edges lie one to three pixels off colour edges on a Kinect.
    pub dilation: f32,
    /// Width of the rim where it has no depth, in the same pixels; 0..=64, default 8: the shadow at the side
    /// of a structured-light silhouette. A value below `dilation` counts as `dilation`.
    pub shadow: f32,
}

impl Default for MaskConfig {
    fn default() -> Self {
        Self { mode: MaskMode::default(), dilation: 3.0, shadow: 8.0 }
    }
}

impl MaskConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("dynamics.mask.dilation", self.dilation.into(), 0.0..=64.0)?;
        check_range("dynamics.mask.shadow", self.shadow.into(), 0.0..=64.0)
    }
}

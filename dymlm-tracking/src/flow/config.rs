use dymlm_core::{ConfigError, check_range};

/// How the brightness of a point may change between two images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Lighting {
    /// Brightness stays the same (Bouguet).
    #[default]
    Constant,
    /// Each window changes by a factor and an offset, as with surfaces that turn in the light or a new
    /// exposure.
    Affine,
}

/// Settings of [`OpticalFlow`](crate::OpticalFlow).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct FlowConfig {
    /// Radius of the window, which has 2 radius + 1 pixels a side; 1..=15, default 10 (21x21, as in
    /// `OpenCV`).
    pub window_radius: usize,
    /// Number of pyramid levels above the image itself, 0..=15, default 3, which finds motions of up to about
    /// 2^3 window radii.
    pub halvings: usize,
    /// Largest distance from its start at which a point tracked forth and back may end, pixels; 0..=100,
    /// default 0.7. `None` = points are not tracked back, which saves half of the time.
    pub max_forward_backward: Option<f32>,
    /// How brightness may change. Default [`Lighting::Constant`].
    pub lighting: Lighting,
}

impl Default for FlowConfig {
    fn default() -> Self {
        Self {
            window_radius: 10,
            halvings: 3,
            max_forward_backward: Some(0.7),
            lighting: Lighting::default(),
        }
    }
}

impl FlowConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("flow.window_radius", self.window_radius as f64, 1.0..=15.0)?;
        check_range("flow.halvings", self.halvings as f64, 0.0..=15.0)?;
        check_range("flow.max_forward_backward", self.max_forward_backward.unwrap_or(0.0).into(), 0.0..=100.0)
    }
}

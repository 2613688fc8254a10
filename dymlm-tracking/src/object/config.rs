use dymlm_core::{ConfigError, check_range};

use super::view::Likeness;
use crate::{CornerConfig, FlowConfig, KcfConfig, Lighting, RansacConfig, RefinerConfig};

/// Settings of [`ObjectTracker`](crate::ObjectTracker).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ObjectTrackerConfig {
    /// The window tracker. Default: windows of 2.5 times the object's size (a hand moves fast), resampled to 96 pixels.
    pub kcf: KcfConfig,
    /// The flow from frame to frame. Default: windows of 15x15, light may change.
    pub flow: FlowConfig,
    /// Corners on the object. Default: at most 80 at once, 5 px apart.
    pub corners: CornerConfig,
    /// The consensus between points.
    pub ransac: RansacConfig,
    /// The final fit.
    pub refiner: RefinerConfig,
    /// Points measured against stored views in each frame, 8..=1000, default 100.
    pub max_points: usize,
    /// Stored views, 1..=1000, default 48. Each holds a cut-out of an image.
    pub max_views: usize,
    /// A view is added when the object has turned by this much from all stored ones, radians, 0.01..=1.5, default 0.26
    /// (15 degrees).
    pub view_angle: f64,
    /// Radius of the windows that are compared with stored views, pixels, 2..=15, default 6.
    pub view_radius: usize,
    /// Least correlation of such a window, 0..=1, default 0.8.
    pub min_correlation: f32,
    /// Least number of points that agree on a pose, 4..=1000, default 6.
    pub min_inliers: usize,
    /// Least share of the measured points that agree on a pose, 0..=1, default 0.35.
    pub min_inlier_share: f64,
    /// Share of the visible surface behind something nearer from which on the object counts as occluded, 0..=1, default
    /// 0.5.
    pub occluded_share: f64,
    /// Time without a pose after which the object is lost, seconds, 0..=60, default 0.5.
    pub lost_after: f64,
    /// The object comes to rest when it has moved by less than `rest_distance` and `rest_angle` for this time, seconds,
    /// 0.05..=60, default 0.8. It leaves when it has moved by three times as much.
    pub rest_time: f64,
    /// Metres, 1e-4..=1, default 0.01: twice what the pose wavers by at 2 m.
    pub rest_distance: f64,
    /// Radians, 1e-3..=1, default 0.05 (3 degrees).
    pub rest_angle: f64,
    /// Standard deviation of the object's acceleration, metres per second squared, 0.01..=1000, default 3: what a hand
    /// that shakes something reaches.
    pub acceleration: f64,
    /// The same of its turning, radians per second squared, 0.01..=1000, default 8.
    pub angular_acceleration: f64,
    /// Standard deviation of a tracked pixel, pixels, 0.01..=10, default 0.5.
    pub pixel_sigma: f64,
    /// Standard deviation of the model's surface from the object's, metres, 1e-4..=1, default 0.008: a map's box about a
    /// bottle. Without depth, points of the object are laid on the model and corrected as it turns.
    pub model_sigma: f64,
    /// Factor on the depth camera's axial noise for a reading on the object, 0.1..=100, default 2: readings of one
    /// surface err alike.
    pub depth_sigma_factor: f64,
    /// Farthest that a reading of the object's surface may lie from the model, metres, 1e-3..=1, default 0.025.
    pub surface_gate: f64,
}

impl Default for ObjectTrackerConfig {
    fn default() -> Self {
        let flow = FlowConfig {
            window_radius: 7,
            lighting: Lighting::Affine,
            max_forward_backward: Some(1.0),
            ..FlowConfig::default()
        };
        let corners = CornerConfig { max_corners: 80, min_distance: 5.0, ..CornerConfig::default() };
        Self {
            kcf: KcfConfig { padding: 2.5, template_size: 96, ..KcfConfig::default() },
            flow,
            corners,
            ransac: RansacConfig {
                max_pixels: 3.0,
                max_distance: 0.03,
                iterations: 200,
                ..RansacConfig::default()
            },
            refiner: RefinerConfig::default(),
            max_points: 100,
            max_views: 48,
            view_angle: 0.26,
            view_radius: 6,
            min_correlation: 0.6,
            min_inliers: 6,
            min_inlier_share: 0.35,
            occluded_share: 0.5,
            lost_after: 0.5,
            rest_time: 0.8,
            rest_distance: 0.01,
            rest_angle: 0.05,
            acceleration: 3.0,
            angular_acceleration: 8.0,
            pixel_sigma: 0.5,
            model_sigma: 0.008,
            depth_sigma_factor: 2.0,
            surface_gate: 0.025,
        }
    }
}

impl ObjectTrackerConfig {
    pub(super) fn likeness(&self) -> Likeness {
        Likeness { radius: self.view_radius, min_correlation: self.min_correlation, halvings: 0 }
    }

    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        self.kcf.validate()?;
        self.flow.validate()?;
        self.corners.validate()?;
        self.ransac.validate()?;
        self.refiner.validate()?;
        check_range("max_points", self.max_points as f64, 8.0..=1000.0)?;
        check_range("max_views", self.max_views as f64, 1.0..=1000.0)?;
        check_range("view_angle", self.view_angle, 0.01..=1.5)?;
        check_range("view_radius", self.view_radius as f64, 2.0..=15.0)?;
        check_range("min_correlation", self.min_correlation.into(), 0.0..=1.0)?;
        check_range("min_inliers", self.min_inliers as f64, 4.0..=1000.0)?;
        check_range("min_inlier_share", self.min_inlier_share, 0.0..=1.0)?;
        check_range("occluded_share", self.occluded_share, 0.0..=1.0)?;
        check_range("lost_after", self.lost_after, 0.0..=60.0)?;
        check_range("rest_time", self.rest_time, 0.05..=60.0)?;
        check_range("rest_distance", self.rest_distance, 1e-4..=1.0)?;
        check_range("rest_angle", self.rest_angle, 1e-3..=1.0)?;
        check_range("acceleration", self.acceleration, 0.01..=1000.0)?;
        check_range("angular_acceleration", self.angular_acceleration, 0.01..=1000.0)?;
        check_range("pixel_sigma", self.pixel_sigma, 0.01..=10.0)?;
        check_range("model_sigma", self.model_sigma, 1e-4..=1.0)?;
        check_range("depth_sigma_factor", self.depth_sigma_factor, 0.1..=100.0)?;
        check_range("surface_gate", self.surface_gate, 1e-3..=1.0)
    }
}

use std::path::PathBuf;

use dymlm_core::{ConfigError, check_range};
use serde::{Deserialize, Serialize};

/// How a bag is opened. Topics that are not named here are found by their types.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct McapOptions {
    /// Topic of the depth images. Default `None`: a topic with a depth encoding, preferably one that is
    /// registered to a colour camera.
    pub depth: Option<String>,
    /// Topic of the colour images. Default `None`: a topic with a colour encoding, preferably in the depth
    /// images' tf frame. If there is none, frames have no colour.
    pub color: Option<String>,
    /// Topic of the depth images' `CameraInfo`. Default `None`: the `camera_info` beside the images.
    pub depth_info: Option<String>,
    /// Topic of the colour images' `CameraInfo`. Default `None`: the `camera_info` beside the images.
    pub color_info: Option<String>,
    /// Topic of the `Detection2DArray`s. Default `None`: the bag's only topic of that type.
    pub detections: Option<String>,
    /// Whether the bag's detections are ignored, because another detector runs on its frames. Default: false.
    pub without_detections: bool,
    /// Topic of an `Odometry` that replaces tf's motion of its child frame. Default `None`: tf, and odometry
    /// for frames that tf does not move.
    pub odometry: Option<String>,
    /// The tf frame that is the world. Default `None`: the root of the tree above the camera.
    pub world_frame: Option<String>,
    /// Labels of numeric class ids: class id n has the n-th label, from 0. Default: none; then the ids are
    /// the labels.
    pub class_names: Vec<String>,
    /// A TUM trajectory with the poses of the frames' camera, used instead of the bag's. Default `None`.
    pub trajectory: Option<PathBuf>,
    /// Largest distance in time between a colour image and its depth image, and between detections and their
    /// image, seconds, 0..=10. Default 0.02, as for TUM datasets.
    pub max_association_gap: f64,
    /// Largest time between two transforms for which a pose between them is interpolated, seconds, 0..=60.
    /// Default 0.2, as for TUM datasets. The limit does not apply where the two differ by less than 2 cm and
    /// 1 degree: a localization may publish `map` to `odom` only once a second. tf2 itself has no limit.
    pub max_interpolation_gap: f64,
    /// Every n-th frame is used, beginning with the first, 1... Default 1.
    pub every: usize,
}

impl Default for McapOptions {
    fn default() -> Self {
        Self {
            depth: None,
            color: None,
            depth_info: None,
            color_info: None,
            detections: None,
            without_detections: false,
            odometry: None,
            world_frame: None,
            class_names: Vec::new(),
            trajectory: None,
            max_association_gap: 0.02,
            max_interpolation_gap: 0.2,
            every: 1,
        }
    }
}

impl McapOptions {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("mcap.max_association_gap", self.max_association_gap, 0.0..=10.0)?;
        check_range("mcap.max_interpolation_gap", self.max_interpolation_gap, 0.0..=60.0)?;
        check_range("mcap.every", self.every as f64, 1.0..=1e9)
    }
}

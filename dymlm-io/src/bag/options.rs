use std::path::PathBuf;

use dymlm_core::{ConfigError, check_range};
use serde::{Deserialize, Serialize};

/// How a bag is opened. Topics that are not named are found by their types.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct McapOptions {
    /// Topic of the depth images. Default: none, that is images of a depth encoding, preferably those that are
    /// registered to a colour camera.
    pub depth: Option<String>,
    /// Topic of the colour images. Default: none, that is images of a colour encoding, preferably of the depth
    /// images' frame; without any, frames have no colour.
    pub color: Option<String>,
    /// Topic of the depth images' `CameraInfo`. Default: none, that is the one beside the images.
    pub depth_info: Option<String>,
    /// Topic of the colour images' `CameraInfo`. Default: none, that is the one beside the images.
    pub color_info: Option<String>,
    /// Topic of the `Detection2DArray`s. Default: none, that is the only one there is.
    pub detections: Option<String>,
    /// Leaves the bag's detections alone: somebody else detects in its frames. Default: false.
    pub without_detections: bool,
    /// Topic of an `Odometry` that moves its child frame instead of what tf says of it. Default: none, that is
    /// tf, and odometry for frames that tf does not move.
    pub odometry: Option<String>,
    /// The tf frame that is the world. Default: none, that is the root above the camera.
    pub world_frame: Option<String>,
    /// Labels of numeric class ids, in the order of their numbers. Default: none; ids are then labels.
    pub class_names: Vec<String>,
    /// A TUM trajectory of the (colour) camera's poses to use instead of the bag's. Default: none.
    pub trajectory: Option<PathBuf>,
    /// Largest distance in time between a colour image and its depth image, and between detections and their
    /// image, seconds, 0..=10. Default 0.02, as for TUM datasets.
    pub max_association_gap: f64,
    /// Largest distance in time between two transforms that are interpolated between, seconds, 0..=60. Default
    /// 0.2, as for TUM datasets. It is no limit to those that differ by less than 2 cm and 1 degree, such as a
    /// localization's `map` to `odom` once a second. tf2 itself has no limit.
    pub max_interpolation_gap: f64,
    /// Every how many frames one is taken, beginning with the first, 1... Default 1.
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

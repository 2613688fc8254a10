use std::path::PathBuf;

use dymlm_core::{ConfigError, check_range};
use serde::{Deserialize, Serialize};

use super::tum_camera::TumCamera;

/// How a TUM dataset is opened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct TumOptions {
    /// A trajectory to use instead of the dataset's `groundtruth.txt`, in the same format. Default `None`.
    pub trajectory: Option<PathBuf>,
    /// Reads no trajectory: for callers that want the images alone. No frame has a pose, so that none can be
    /// loaded as a whole. Default `false`.
    pub without_poses: bool,
    /// A camera to use instead of the dataset's own. Default `None`: the folder's `camera.json` or, without
    /// it, the camera in the folder's name.
    pub camera: Option<TumCamera>,
    /// Largest time between a colour image and its depth image when there is no `associations.txt`, seconds,
    /// 0..=10. Default 0.02, as in the benchmark's own `associate.py`.
    pub max_association_gap: f64,
    /// Largest time between two poses for which a pose between them is interpolated, seconds, 0..=60. Default
    /// 0.2: over an interval dt at acceleration a, the straight line departs from the path by up to a dt^2 /
    /// 8. At the 2 m/s^2 of a hand-held camera that is 1 cm, the map's finest voxel.
    pub max_interpolation_gap: f64,
    /// Every n-th frame is used, beginning with the first, 1... Default 1.
    pub every: usize,
}

impl Default for TumOptions {
    fn default() -> Self {
        Self {
            trajectory: None,
            without_poses: false,
            camera: None,
            max_association_gap: 0.02,
            max_interpolation_gap: 0.2,
            every: 1,
        }
    }
}

impl TumOptions {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("tum.max_association_gap", self.max_association_gap, 0.0..=10.0)?;
        check_range("tum.max_interpolation_gap", self.max_interpolation_gap, 0.0..=60.0)?;
        check_range("tum.every", self.every as f64, 1.0..=1e9)
    }
}

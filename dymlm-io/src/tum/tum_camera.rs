use std::path::Path;

use dymlm_core::PinholeCamera;
use serde::{Deserialize, Serialize};

/// A camera of the TUM RGB-D benchmark (Sturm 2012), with the benchmark's calibration. Its depth images are
/// registered to the colour images. Lens distortion is not removed from either, as in the benchmark's own
/// tools.
///
/// ```
/// use dymlm_io::TumCamera;
///
/// let camera = TumCamera::named_in("data/rgbd_dataset_freiburg3_walking_xyz".as_ref());
/// assert_eq!(camera, Some(TumCamera::Freiburg3));
/// assert_eq!(TumCamera::Freiburg3.camera()?.fx(), 535.4);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TumCamera {
    /// Sequences fr1; fx, fy, cx, cy: 517.3, 516.5, 318.6, 255.3.
    Freiburg1,
    /// Sequences fr2; fx, fy, cx, cy: 520.9, 521.0, 325.1, 249.7.
    Freiburg2,
    /// Sequences fr3, already rectified; fx, fy, cx, cy: 535.4, 539.2, 320.1, 247.6.
    Freiburg3,
}

impl TumCamera {
    /// Stored depth units in a metre.
    pub const DEPTH_SCALE: f64 = 5000.0;

    /// The camera that a folder's name contains.
    #[must_use]
    pub fn named_in(folder: &Path) -> Option<Self> {
        let name = folder.file_name()?.to_string_lossy().to_ascii_lowercase();
        let cameras = [Self::Freiburg1, Self::Freiburg2, Self::Freiburg3];
        cameras
            .into_iter()
            .zip(["freiburg1", "freiburg2", "freiburg3"])
            .find_map(|(camera, written)| name.contains(written).then_some(camera))
    }

    /// The camera, 640x480 pixels.
    ///
    /// # Errors
    ///
    /// Never fails: the parameters are in range.
    pub fn camera(self) -> Result<PinholeCamera, dymlm_core::Error> {
        let [fx, fy, cx, cy] = match self {
            Self::Freiburg1 => [517.3, 516.5, 318.6, 255.3],
            Self::Freiburg2 => [520.9, 521.0, 325.1, 249.7],
            Self::Freiburg3 => [535.4, 539.2, 320.1, 247.6],
        };
        PinholeCamera::new(640, 480, fx, fy, cx, cy)
    }
}

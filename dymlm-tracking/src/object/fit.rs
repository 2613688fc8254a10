use dymlm_core::Pose;

use super::surface::SurfaceReadings;
use super::view::PointMatch;

/// A pose that fits a frame.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) camera_from_object: Pose,
    pub(super) covariance: Option<[[f64; 6]; 6]>,
    /// Points that agree with the pose.
    pub(super) matches: Vec<PointMatch>,
    /// Share of the matched points that agree with the pose.
    pub(super) share: f64,
    pub(super) surface: SurfaceReadings,
    /// Whether it was found by a search that does not use the object's motion.
    pub(super) is_found: bool,
}

impl Fit {
    /// Standard deviations of the pose, radians and metres.
    pub(super) fn sigmas(&self) -> Option<[f64; 2]> {
        let c = self.covariance?;
        Some([0, 3].map(|first| (first..first + 3).map(|i| c[i][i]).sum::<f64>().sqrt()))
    }

    /// Whether the pose is at least as certain as these standard deviations, radians and metres.
    pub(super) fn is_known(&self, [angle, place]: [f64; 2]) -> bool {
        self.sigmas().is_some_and(|sigmas| sigmas[0] <= angle && sigmas[1] <= place)
    }
}

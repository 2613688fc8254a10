use dymlm_core::Pose;

use super::surface::SurfaceReadings;
use super::view::PointMatch;

/// A pose that fits what a frame shows.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) camera_from_object: Pose,
    pub(super) covariance: Option<[[f64; 6]; 6]>,
    /// Points that agree.
    pub(super) matches: Vec<PointMatch>,
    /// Share of the points found that agree.
    pub(super) share: f64,
    pub(super) surface: SurfaceReadings,
    /// Whether it had to be searched, without regard to its motion.
    pub(super) is_found: bool,
}

impl Fit {
    /// Its standard deviations, radians and metres.
    pub(super) fn sigmas(&self) -> Option<[f64; 2]> {
        let c = self.covariance?;
        Some([0, 3].map(|first| (first..first + 3).map(|i| c[i][i]).sum::<f64>().sqrt()))
    }

    /// Whether it is known to these standard deviations, radians and metres.
    pub(super) fn is_known(&self, [angle, place]: [f64; 2]) -> bool {
        self.sigmas().is_some_and(|sigmas| sigmas[0] <= angle && sigmas[1] <= place)
    }
}

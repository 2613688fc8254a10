use dymlm_core::Plane;

use super::covariance::PlaneCovariance;
use super::plane_samples::PlaneSamples;
use crate::moments::Moments;

/// One refined plane of one frame, from which the map is built. Camera frame.
///
/// It holds all that the map needs, and no images: a key frame's planes can be stored and inserted again at
/// another pose.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DetectedPlane {
    /// The robustly fitted plane; its normal points to the camera.
    pub plane: Plane,
    /// Weighted mean of its inliers, metres.
    pub centroid: [f64; 3],
    /// Uncertainty of the plane.
    pub covariance: PlaneCovariance,
    /// Weighted mean squared distance of the inliers, square metres.
    pub mse: f64,
    /// Number of pixels of the segment.
    pub support: usize,
    /// Number of these pixels that are inliers of the refined plane.
    pub inliers: usize,
    /// Area of the inliers, square metres.
    pub area: f64,
    /// Every fourth inlier along rows and columns (of a camera with a Kinect's focal length): its patch.
    pub samples: PlaneSamples,
    /// The label of its pixels in [`PlaneDetector::labels`](crate::PlaneDetector::labels).
    pub label: u16,
    /// Sums over the inliers, weighted by 1 / sigma(z)^2; a reading with the sensor's least noise (a Kinect's
    /// at 0.4 m) has weight 1.
    pub(crate) moments: Moments,
}

impl DetectedPlane {
    /// Share of the segment's pixels that are inliers, 0..=1.
    pub fn inlier_ratio(&self) -> f64 {
        self.inliers as f64 / self.support.max(1) as f64
    }
}

//! Planes of one frame. See [`PlaneDetector`].

mod config;
mod covariance;
mod detected_plane;
mod extraction;
mod filter;
mod patch_range;
mod plane_bytes;
mod plane_detector;
mod plane_samples;
mod rays;
mod reading_noise;
mod refinement;
mod through_step;
mod wide_noise;

pub use config::PlaneDetectorConfig;
pub use covariance::PlaneCovariance;
pub use detected_plane::DetectedPlane;
pub(crate) use extraction::SMALLEST_BLOCK;
pub use filter::{RejectedPlane, RejectionCause};
pub(crate) use patch_range::patch_range;
pub use plane_detector::PlaneDetector;
pub use plane_samples::PlaneSamples;
pub(crate) use plane_samples::{MOST_SITES, RayLattice};

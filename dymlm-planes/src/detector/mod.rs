//! Planes of one frame. See [`PlaneDetector`].

mod config;
mod detected_plane;
mod extraction;
mod filter;
mod plane_detector;
mod rays;
mod refinement;

pub use config::PlaneDetectorConfig;
pub use detected_plane::DetectedPlane;
pub use filter::{RejectedPlane, RejectionCause};
pub use plane_detector::PlaneDetector;
pub use refinement::PlaneCovariance;

//! The second, robust fit of extracted planes. See [`PlaneRefiner`].

mod config;
mod covariance;
mod detected_plane;
mod edge_points;
mod refiner;
mod reweighting;
mod runs;

pub use config::RefinementConfig;
pub use covariance::PlaneCovariance;
pub use detected_plane::DetectedPlane;
pub use refiner::PlaneRefiner;

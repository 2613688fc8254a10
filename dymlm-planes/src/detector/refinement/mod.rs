//! The second, robust fit of extracted planes. See [`PlaneRefiner`].

mod covariance;
mod edge_points;
mod refiner;
mod reweighting;
mod runs;

pub use covariance::PlaneCovariance;
pub(super) use refiner::PlaneRefiner;

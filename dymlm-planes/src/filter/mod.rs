//! Which detected planes reach the map. See [`PlaneFilter`].

mod config;
mod plane_filter;

pub use config::FilterConfig;
pub use plane_filter::{PlaneFilter, RejectedPlane, RejectionCause};

//! Planes in RGB-D frames: extraction, robust refinement, association, and a map of finite planes.
//!
//! The plane map of "`DyMLM`" (paper III-B) has two parts: [`PlaneDetector`] finds the planes of a frame;
//! [`PlaneMap`] associates them with its planes, fuses them, and merges planes that prove to be one.
//! [`PlaneMapper`] joins the two.

mod association;
mod boundary;
mod config;
mod detector;
mod error;
mod linear_algebra;
mod mapper;
mod moments;
mod patches;
mod plane_frame;
mod plane_map;
mod queries;
mod shared_map;

pub use association::{AssociationConfig, Sides};
pub use boundary::BoundaryPolygon;
pub use config::PlaneConfig;
pub use detector::{
    DetectedPlane, PlaneCovariance, PlaneDetector, PlaneDetectorConfig, PlaneSamples, RejectedPlane,
    RejectionCause,
};
pub use error::Error;
pub use mapper::PlaneMapper;
pub use plane_map::{MapPlane, PlaneMap, PlaneMapConfig, PlaneMerge, PlaneReport, PlaneSighting};
pub use queries::{LevelUnder, PlaneHit, Surface, SurfaceConfig, SurfaceKind};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

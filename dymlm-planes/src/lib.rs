//! Planes in RGB-D frames: extraction, robust refinement, association, and a map of finite planes.
//!
//! The plane map of "`DyMLM`" (paper III-B, DESIGN 4.4), one step a type:
//!
//! | step | type |
//! | --- | --- |
//! | extract planes from the depth image | [`PlaneExtractor`] |
//! | refine them: robust fit, inliers, edge points, covariance | [`PlaneRefiner`] |
//! | filter by depth, inliers, movers | [`PlaneFilter`] |
//! | associate, fuse, merge | [`PlaneMap`] |
//!
//! [`PlaneDetector`] runs the first three on a frame, [`PlaneMapper`] all of them.

mod association;
mod boundary;
mod config;
mod detector;
mod error;
mod extraction;
mod filter;
mod linear_algebra;
mod mapper;
mod moments;
mod plane_grid;
mod plane_map;
mod queries;
mod refinement;

pub use association::{AssociationConfig, Sides};
pub use boundary::BoundaryPolygon;
pub use config::PlaneConfig;
pub use detector::PlaneDetector;
pub use error::PlaneError;
pub use extraction::{Extraction, ExtractionConfig, PlaneExtractor, Segment};
pub use filter::{FilterConfig, PlaneFilter, RejectedPlane, RejectionCause};
pub use mapper::PlaneMapper;
pub use plane_map::{MapPlane, PlaneMap, PlaneMapConfig, PlaneMerge, PlaneReport};
pub use queries::{PlaneHit, Surface, SurfaceConfig, SurfaceKind};
pub use refinement::{DetectedPlane, PlaneCovariance, PlaneRefiner, RefinementConfig};

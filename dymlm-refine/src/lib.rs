//! Camera poses refined by what the maps know: planes and landmarks that many key frames have seen, relative
//! poses of odometry and of loop closures. Sparse least squares on SE(3).
//!
//! The paper names this as future work. Planes enter only by the moments of their inliers, so that the cost
//! of a solve does not depend on the number of points (Eigen-Factors, BALM 2).

mod cholesky;
mod descent;
mod elimination;
mod error;
mod front;
mod graduation;
mod landmark_view;
mod lie;
mod normal_equations;
mod plane_view;
mod pose_conversion;
mod pose_graph;
mod relative_pose;
mod solver_config;
mod track;
mod view;

pub use error::Error;
pub use landmark_view::LandmarkView;
pub use plane_view::PlaneView;
pub use pose_graph::{PoseGraph, Solution};
pub use relative_pose::RelativePose;
pub use solver_config::SolverConfig;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

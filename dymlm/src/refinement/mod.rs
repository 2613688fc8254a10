//! Poses refined by what the maps know: see
//! [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses).

mod config;
mod face;
mod links;
mod loop_closure;
mod object_views;
mod odometry_drift;
mod patch;
mod plane_groups;
mod plane_visits;
mod pose_problem;
mod refine_poses;
mod refined_poses;
mod report;
mod unheld_motion;

pub use config::RefineConfig;
pub use loop_closure::LoopClosure;
pub use refined_poses::RefinedPoses;
pub use report::RefineReport;
pub use unheld_motion::{MotionKind, UnheldMotion};

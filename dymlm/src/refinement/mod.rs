//! Poses refined by what the maps know: see
//! [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses).

mod config;
mod refine_poses;
mod report;

pub use config::RefineConfig;
pub use report::RefineReport;

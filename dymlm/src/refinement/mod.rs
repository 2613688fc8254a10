//! Poses refined by what the maps know: see
//! [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses).

mod config;
mod loop_closure;
mod refine_poses;
mod report;

pub use config::RefineConfig;
pub use loop_closure::LoopClosure;
pub use report::RefineReport;

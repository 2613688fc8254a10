//! Tracking of 2D boxes.

mod assignment;
mod box_kalman;
mod box_tracker;
mod ego_motion;
mod tracked_box;
mod tracker_config;
mod view;

pub use box_kalman::BoxKalman;
pub use box_tracker::BoxTracker;
pub(crate) use box_tracker::LOW_SCORE;
pub use tracked_box::{BoxSource, TrackState, TrackedBox};
pub use tracker_config::TrackerConfig;
pub use view::View;

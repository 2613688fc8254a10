//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stderr, clippy::unwrap_used)]

mod cloud_score;
mod days;
mod detector;
mod dynamic_map_score;
mod events;
mod floor_plan;
mod occupancy_score;
mod pose_error;
mod scenes;
mod sequence;
mod truth;

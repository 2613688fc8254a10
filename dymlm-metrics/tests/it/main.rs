//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stderr, clippy::unwrap_used)]

mod object_score;
mod occupancy_score;
mod plane_score;
mod reference_cloud;
mod results_are_data;
mod tracking_score;

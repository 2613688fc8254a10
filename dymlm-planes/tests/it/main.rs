//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod cameras;
mod common;
mod covariance;
mod degenerate;
mod faces;
mod growth;
mod hidden_gaps;
mod labelled_image;
mod map_life;
mod moved_body;
mod mover_boxes;
mod partitions;
mod ramps;
mod shapes;
mod steps;

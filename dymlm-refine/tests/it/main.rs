//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::unwrap_used)]

mod extremes;
mod landmarks;
mod planes;
mod pose_graphs;

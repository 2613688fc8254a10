//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod flow;
mod images;
mod kcf;
mod model;
mod object_tracker;
mod pose;

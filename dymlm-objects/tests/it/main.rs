//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod box_fitter;
mod centroid_test;
mod common;
mod config;
mod in_space;
mod mapper;
mod moved_object;
mod occluded;
mod outlines;
mod parameterizer;
mod sequences;

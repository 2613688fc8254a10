//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod build_map;
mod evaluate;
mod example_program;
mod kitchen;
mod kitchen_objects;
mod kitchen_planes;
mod kitchen_refinement;
mod map;
mod readme;
mod report_page;
mod track_object;

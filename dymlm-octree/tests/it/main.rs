//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::expect_used, clippy::panic, clippy::print_stderr, clippy::unwrap_used)]

mod clones;
mod common;
mod copies;
mod distance_field;
mod files;
mod freed_cells;
mod grid_updates;
mod insertion;
mod map_file;
mod moved_body;
mod octomap;
mod projection;
mod queries;
mod saved_state;
mod scan_size;

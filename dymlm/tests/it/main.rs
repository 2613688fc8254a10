//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stderr, clippy::unwrap_used)]

mod appearing_wall;
mod common;
mod config_files;
mod corrected_poses;
mod flipped_images;
mod floor_grids;
mod landmarks;
mod late_detections;
mod map_builder;
mod memory;
mod memory_budget;
mod moved_object;
mod pushed_box;
mod queries;
mod readers;
mod refinement;
mod saved_maps;
mod scans;
mod session_recorder;
mod unlabelled_mover;

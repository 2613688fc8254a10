//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stderr, clippy::unreadable_literal, clippy::unwrap_used)]

mod common;
mod detections;
mod gltf;
mod images;
mod map_folder;
mod map_folder_saver;
mod map_records;
mod mcap;
mod mcap_writer;
mod pcd;
mod ply;
mod real_data;
mod trajectory;
mod tum;
mod tum_cameras;
mod tum_writer;

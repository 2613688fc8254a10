//! The bodies of the fuzz targets. A [`Body`] takes any bytes and fails by a panic.
//!
//! `fuzz/` runs them with cargo-fuzz on nightly Rust; [`run`] runs them with its own mutation loop on stable
//! Rust: some seconds in the gate, an hour in `.ci/nightly`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::missing_panics_doc,
    reason = "for tests: a panic is a finding"
)]

mod any_frame;
mod calls;
mod carried_object;
mod choices;
mod correct_poses;
mod damage;
mod fingerprint;
mod insert;
mod map_builder;
mod memory_folder;
mod merge;
mod octree_model;
mod readers;
mod run;
mod saved_map;
mod saved_parts;
mod walk;

pub use carried_object::carried_object;
pub use correct_poses::correct_poses;
pub use insert::insert;
pub use map_builder::map_builder;
pub use merge::merge;
pub use octree_model::octree_model;
pub use readers::{
    read_bt, read_config, read_detections, read_image, read_map_file, read_map_folder, read_mcap, read_ot,
    read_pcd, read_ply, read_records, read_saved_folder, read_trajectory, read_tum, read_yolo,
};
pub use run::{Effort, run};
pub use saved_map::saved_map;
pub use saved_parts::{saved_cloud, saved_history, saved_objects, saved_octree, saved_planes};

/// A function that takes any bytes; a panic is a finding.
pub type Body = fn(&[u8]);

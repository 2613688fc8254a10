//! What fuzzers drive. A [`Body`] takes any bytes, and fails by a panic.
//!
//! `fuzz/` drives them by cargo-fuzz, on nightly; [`run`] by an own loop of mutations, on stable: some
//! seconds in the gate, an hour in `.ci/nightly`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::missing_panics_doc,
    reason = "for tests: a panic is a finding"
)]

mod carried_object;
mod choices;
mod damage;
mod map_builder;
mod octree_model;
mod readers;
mod run;
mod saved_map;
mod saved_parts;
mod walk;

pub use carried_object::carried_object;
pub use map_builder::map_builder;
pub use octree_model::octree_model;
pub use readers::{
    read_bt, read_detections, read_map_folder, read_ot, read_pcd, read_ply, read_records, read_tum, read_yolo,
};
pub use run::{Effort, run};
pub use saved_map::saved_map;
pub use saved_parts::{saved_cloud, saved_history, saved_objects, saved_octree, saved_planes};

/// Any bytes in; a panic is a finding.
pub type Body = fn(&[u8]);

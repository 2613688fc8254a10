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

mod choices;
mod map_builder;
mod octree_model;
mod readers;
mod run;

pub use map_builder::map_builder;
pub use octree_model::octree_model;
pub use readers::{
    read_bt, read_detections, read_map_folder, read_ot, read_pcd, read_ply, read_records, read_tum, read_yolo,
};
pub use run::{Effort, run};

/// Any bytes in; a panic is a finding.
pub type Body = fn(&[u8]);

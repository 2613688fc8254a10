//! Code that tests and benches of several crates share.
//!
//! - [`recording`] finds the real recordings, [`recorded_frames`] reads those of people with exact masks.
//! - [`World`] is a few exact bodies that rays are cast at; `dymlm-sim` renders whole rooms.
//! - [`DetectorStatistics`] measures the errors of a 2D detector, simulated or real.
//! - [`saved_parts`] and its neighbours save states and damage them.
//! - [`read_g2o`] reads pose graphs.
//! - [`growth`] measures how time grows with the input, by the processor time of a thread; [`processor_time`] is that of all.
//! - [`cases`] says how many random cases a slow property is tried on.
//! - [`normal`] and [`shuffle`] draw from [`SplitMix64`](dymlm_core::SplitMix64); [`checksum`] compares bits.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc, reason = "for tests: a panic fails the test")]

mod cases;
mod detector_statistics;
mod growth;
mod pose_graph_file;
mod processor_time;
mod random;
mod recorded_people;
mod recording;
mod saved_parts;
mod world;

pub use cases::cases;
pub use detector_statistics::{
    DetectorFigures, DetectorStatistics, ExactView, FigureRow, SideFigures, SizeFigures,
};
pub use growth::growth;
pub use pose_graph_file::{MeasuredPose, read_g2o};
pub use processor_time::processor_time;
pub use random::{checksum, normal, shuffle, whole_numbers};
pub use recorded_people::{RecordedFrame, recorded_frames};
pub use recording::recording;
pub use saved_parts::{LoadedParts, SavedParts, damaged_parts, incomplete_parts, save_into, saved_parts};
pub use world::{Cuboid, Cylinder, Hit, Rectangle, World, look_at, small_camera};

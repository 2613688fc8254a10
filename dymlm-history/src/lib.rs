//! What key frames have shown, compact and in camera coordinates: everything that is needed to take a frame
//! out of the maps and to put it in at another pose, without searching for movers and planes again.
//!
//! An [`Observation`] is exactly what is mapped: depth as it is mapped, colours as they are stored. Packed, it
//! takes some 65 kB for a frame of 640x480; a [`History`] holds many of them, in memory or in a file. It also
//! holds the points of a lidar's scans, as they were given.

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

mod color_code;
mod depth_code;
mod entropy_code;
mod error;
mod history;
mod kept;
mod number_plane;
mod number_row;
mod observation;
mod packer;
mod packing;
mod packing_buffers;
mod prediction;
#[cfg(feature = "state")]
mod saved_state;
mod scan_code;

pub use color_code::ReducedColors;
pub use error::Error;
pub use history::{History, HistoryConfig};
pub use observation::Observation;

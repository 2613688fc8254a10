//! The state of maps in a map folder: what its standard files cannot hold, in parts of which each save writes
//! those that have changed.
//!
//! Parts stand in segment files, one behind the other, deflated, each with its checksum; `state.index` says
//! where. A save writes a new segment, and links the older ones into the new folder: none of them ever
//! changes. Segments of which little is in use any more, and the newest ones as long as they are not much
//! larger than what is written, are written again into the new one: so there are few, and each part is
//! written a number of times that grows with the logarithm of the state.

mod index;
mod reader;
mod saver;
mod segment;

pub use reader::{DamagedPart, StateParts};
pub use saver::{MapFolderSaver, StateWriter};

/// The name of the index.
pub(super) const INDEX: &str = "state.index";

/// The name of a segment.
fn segment_name(number: u32) -> String {
    format!("state-{number:06}.bin")
}

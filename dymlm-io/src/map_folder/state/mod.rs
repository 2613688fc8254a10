//! The state of maps in a map folder: what its standard files cannot hold. It is divided into parts, and each
//! save writes only the parts that have changed.
//!
//! Parts stand one after the other in segment files, deflated if they are not packed already, each with its
//! checksum; `state.index` says where. A save writes a new segment, and links the older ones into the new
//! folder, since a segment never changes. Parts in use are copied into the new segment from segments with less
//! than half of their bytes in use, and from the newest ones as long as they are not much larger than what is
//! written. So there are few segments, and each part is written a number of times that grows with the logarithm
//! of the state's size.

mod index;
mod reader;
mod saver;
mod segment;

pub(super) use index::StateIndex;
pub use reader::{DamagedPart, StateParts};
pub use saver::{MapFolderSaver, StateWriter};

/// The name of the index.
pub(super) const INDEX: &str = "state.index";

/// The name of a segment.
fn segment_name(number: u32) -> String {
    format!("state-{number:06}.bin")
}

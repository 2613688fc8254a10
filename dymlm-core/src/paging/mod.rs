//! Parts of maps that are not needed for now go to a file, and come back to the bit: shared by the crates of maps.

mod filed_map;
mod page_file;
mod record;

pub use filed_map::FiledMap;
pub use page_file::{Extent, PageFile};
pub use record::Record;

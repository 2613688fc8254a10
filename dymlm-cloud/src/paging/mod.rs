//! Blocks that no frame has seen for longest go to a file, so that a map of many rooms needs the memory of
//! only those around the camera.

mod page_file;
mod paged;
mod pager;
mod record;

pub(crate) use page_file::PageFile;
#[cfg(feature = "state")]
pub(crate) use paged::Version;
pub(crate) use paged::{Block, PageOut, Paged};
pub use pager::CloudPager;
pub(crate) use record::{Record, record, record_of_cases};

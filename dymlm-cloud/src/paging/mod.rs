//! Blocks that are far from the camera go to a file, so that a map of many rooms needs the memory of those
//! around the camera.

mod page_file;
mod paged;
mod pager;
mod record;

pub(crate) use page_file::PageFile;
pub(crate) use paged::{Block, PageOut, Paged};
pub use pager::CloudPager;
pub(crate) use record::{Record, record, record_of_cases};

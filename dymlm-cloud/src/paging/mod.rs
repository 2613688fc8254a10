//! Blocks that no frame has seen for longest go to a file, so that a map of many rooms needs the memory of
//! only those around the camera.

mod memory_count;
mod paged;
mod pager;

pub(crate) use dymlm_core::paging::{Extent, PageFile, Record};
pub(crate) use dymlm_core::{record, record_of_cases};
#[cfg(feature = "state")]
pub(crate) use paged::Version;
pub(crate) use paged::{Block, Look, PageOut, Paged, page_out};
pub use pager::CloudPager;

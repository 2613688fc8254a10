//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stderr, clippy::unwrap_used)]

mod cloud_map;
mod fused_surfaces;
mod moved_body;
mod paging;
mod queries;
mod scans;

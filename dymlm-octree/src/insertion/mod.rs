//! Insertion of scans: finds the cells that a scan hits and those that its rays pass, and updates the map.
//!
//! A scan marks bits first (one for each cell hit, one for each cell passed) and changes the map afterwards,
//! block by block. So a cell is updated once per scan, hits win over misses, and the map is searched once per
//! block rather than once per cell.

mod cell_colors;
mod cells;
mod insert;
mod marks;
mod ray;
mod reading_row;
mod scan_scratch;
mod scan_size;
mod sparse_marks;
mod window_marks;

pub(crate) use cell_colors::CellColors;
pub use insert::InsertReport;
pub(crate) use scan_scratch::ScanScratch;

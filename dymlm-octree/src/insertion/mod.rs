//! Scans into cells: which cells does a scan hit, which do its rays pass, and the update of the map.
//!
//! A scan marks bits first (one for each cell hit, one for each cell passed) and changes the map afterwards,
//! block by block. So a cell is updated once a scan, hits win over misses, and the map is searched once a
//! block rather than once a cell.

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

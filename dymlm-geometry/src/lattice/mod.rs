//! Cubic lattices, and points sorted by the cell that holds them.

mod bounds;
mod cell_keys;
mod cell_records;
mod cell_sort;
mod cubic_lattice;
mod radix_sort;

pub(crate) use cell_records::{CellRecords, Record};
pub(crate) use cell_sort::CellSort;
pub(crate) use cubic_lattice::CubicLattice;

//! Cubic lattices, and points sorted or numbered by the cell that holds them.

mod bounds;
mod cell_keys;
mod cell_numbers;
mod cell_records;
mod cell_sort;
mod cell_table;
mod cubic_lattice;
mod radix_sort;

pub(crate) use cell_numbers::CellNumbers;
pub(crate) use cell_records::{CellRecords, Record};
pub(crate) use cell_sort::CellSort;
pub(crate) use cubic_lattice::CubicLattice;

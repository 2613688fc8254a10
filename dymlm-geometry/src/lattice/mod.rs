//! Cubic lattices, and points sorted by the cell that holds them.

mod cell_sort;
mod cubic_lattice;
mod radix_sort;

pub(crate) use cell_sort::CellSort;
pub(crate) use cubic_lattice::CubicLattice;

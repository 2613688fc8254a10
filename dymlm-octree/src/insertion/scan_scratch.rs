use std::collections::HashSet;
use std::hash::BuildHasherDefault;

use dymlm_core::Point;

use super::cell_colors::CellColors;
use super::reading_row::Row;
use super::sparse_marks::{IntegerHasher, SparseMarks};
use super::window_marks::WindowMarks;
use crate::lattice::Key;

/// Buffers of an insertion, kept so that a frame allocates nothing. Each call starts by clearing them or
/// leaves them empty.
#[derive(Debug, Default)]
pub(crate) struct ScanScratch {
    /// Where the rays to surfaces end.
    pub(crate) hits: RayEnds,
    /// Where the rays end whose readings are beyond the sensor's range.
    pub(crate) cut: RayEnds,
    pub(crate) window: WindowMarks,
    pub(crate) sparse: SparseMarks,
    /// Cells beyond the range that already have their ray.
    pub(crate) far: HashSet<u64, BuildHasherDefault<IntegerHasher>>,
    pub(crate) colors: CellColors,
    pub(crate) row: Row,
}

/// Ends of rays.
#[derive(Debug, Default)]
pub(crate) struct RayEnds {
    /// Cells of the ends. With one ray per cell, an end in the same cell as the end before is left out.
    pub(crate) keys: Vec<Key>,
    /// The ends themselves, in the order of `keys`; only used when every reading has its own ray.
    pub(crate) points: Vec<Point>,
}

impl RayEnds {
    pub(crate) fn clear(&mut self) {
        self.keys.clear();
        self.points.clear();
    }

    fn memory_bytes(&self) -> usize {
        self.keys.capacity() * size_of::<Key>() + self.points.capacity() * size_of::<Point>()
    }
}

impl ScanScratch {
    pub(crate) fn memory_bytes(&self) -> usize {
        self.window.memory_bytes()
            + self.sparse.memory_bytes()
            + self.far.capacity() * 8
            + self.colors.memory_bytes()
            + self.hits.memory_bytes()
            + self.cut.memory_bytes()
            + self.row.memory_bytes()
    }
}

impl Clone for ScanScratch {
    /// The copy of a map needs no copy of its buffers.
    fn clone(&self) -> Self {
        Self::default()
    }
}

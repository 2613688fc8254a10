use std::ops::Range;

use dymlm_core::Point;

use super::distance::Run;
use crate::lattice::{CellSort, CubicLattice};

/// The points in cells with a diagonal of eps.
///
/// Cells are sorted by x, then y, then z, and the points by cell: a *slot* is a point's place in that order. Cells of
/// the same x and y form a *row*; the points of neighbouring cells of a row lie side by side.
#[derive(Debug, Default)]
pub(super) struct Grid {
    sort: CellSort,
    /// The rows, ascending by x, then y, and one more at the end that closes the last.
    rows: Vec<Row>,
    /// z index of each cell.
    cell_z: Vec<i32>,
    /// First slot of each cell, and the number of slots at the end.
    cell_start: Vec<u32>,
    /// Index into the cloud of each slot.
    point: Vec<u32>,
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) x: i32,
    pub(super) y: i32,
    pub(super) first_cell: u32,
}

impl Grid {
    /// Points within eps lie at most this many cells apart on each axis: a cell's side is more than half of eps.
    pub(super) const REACH: i32 = 2;

    /// Sorts a cloud into cells.
    pub(super) fn build(&mut self, eps: f32, points: &[Point]) {
        // Shorter by 2^-20, so that neither the cell's index nor the test in f32, both good to some 2^-22, parts two
        // points of a cell.
        let side = f64::from(eps) / 3.0_f64.sqrt() * (1.0 - 1.0 / f64::from(1 << 20));
        let lattice = CubicLattice::new(side);
        self.sort.sort(lattice, points);
        self.gather_points(points);
        self.find_rows(lattice);
    }

    fn gather_points(&mut self, points: &[Point]) {
        self.point.clear();
        self.point.extend(self.sort.order());
        for (axis, values) in [&mut self.x, &mut self.y, &mut self.z].into_iter().enumerate() {
            values.clear();
            values.extend(self.point.iter().map(|&point| points[point as usize][axis]));
        }
    }

    fn find_rows(&mut self, lattice: CubicLattice) {
        self.cell_start.clear();
        self.cell_start.extend_from_slice(self.sort.starts());
        self.cell_z.clear();
        self.rows.clear();
        let cell_count = self.cell_count();
        for cell in 0..cell_count {
            let slot = self.cell_start[cell] as usize;
            let (x, y) = (lattice.index(self.x[slot]), lattice.index(self.y[slot]));
            self.cell_z.push(lattice.index(self.z[slot]));
            if self.rows.last().is_none_or(|row| (row.x, row.y) != (x, y)) {
                self.rows.push(Row { x, y, first_cell: cell as u32 });
            }
        }
        self.rows.push(Row { x: i32::MAX, y: i32::MAX, first_cell: cell_count as u32 });
    }

    #[inline]
    pub(super) fn cell_count(&self) -> usize {
        self.cell_start.len().saturating_sub(1)
    }

    /// Number of points in cells.
    #[inline]
    pub(super) fn slot_count(&self) -> usize {
        self.point.len()
    }

    /// The rows, ascending, without the closing one.
    #[inline]
    pub(super) fn rows(&self) -> &[Row] {
        self.rows.split_last().map_or(&[], |(_, rows)| rows)
    }

    /// The cells of a row.
    #[inline]
    pub(super) fn cells_of_row(&self, row: usize) -> Range<usize> {
        self.rows[row].first_cell as usize..self.rows[row + 1].first_cell as usize
    }

    /// The row that holds a cell.
    pub(super) fn row_of_cell(&self, cell: usize) -> usize {
        self.rows().partition_point(|row| row.first_cell as usize <= cell).saturating_sub(1)
    }

    #[inline]
    pub(super) fn z_of_cell(&self, cell: usize) -> i32 {
        self.cell_z[cell]
    }

    /// The slots of neighbouring cells of a row.
    #[inline]
    pub(super) fn slots(&self, cells: Range<usize>) -> Range<usize> {
        self.cell_start[cells.start] as usize..self.cell_start[cells.end] as usize
    }

    /// The points in neighbouring cells of a row.
    #[inline]
    pub(super) fn run(&self, cells: Range<usize>) -> Run<'_> {
        let slots = self.slots(cells);
        Run { x: &self.x[slots.clone()], y: &self.y[slots.clone()], z: &self.z[slots] }
    }

    /// Indices into the cloud of a cell's points, ascending.
    #[inline]
    pub(super) fn point_indices(&self, cell: usize) -> &[u32] {
        &self.point[self.slots(cell..cell + 1)]
    }

    /// Keeps the points whose slots `keep` approves, and their cells, some of them empty now; calls `removed` for each
    /// other point with its cell and its index into the cloud, in the order of the slots.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool, mut removed: impl FnMut(usize, u32)) {
        let mut end = 0;
        for cell in 0..self.cell_count() {
            let slots = self.slots(cell..cell + 1);
            self.cell_start[cell] = end as u32;
            for slot in slots {
                if keep(slot) {
                    for values in [&mut self.x, &mut self.y, &mut self.z] {
                        values[end] = values[slot];
                    }
                    self.point[end] = self.point[slot];
                    end += 1;
                } else {
                    removed(cell, self.point[slot]);
                }
            }
        }
        if let Some(last) = self.cell_start.last_mut() {
            *last = end as u32;
        }
        self.point.truncate(end);
        for values in [&mut self.x, &mut self.y, &mut self.z] {
            values.truncate(end);
        }
    }
}

use std::ops::Range;

use dymlm_core::Point;

use super::run::Run;
use super::touching_blocks::{RowOffset, TouchingBlocks};
use crate::lattice::{CellSort, CubicLattice};
use crate::parallel::{for_each, task_size};

/// The points in *cells* with a diagonal of eps, eight of which make a *block*, two along each axis.
///
/// Points of a cell are within eps of each other, and points within eps of each other lie in blocks that touch. Blocks
/// are sorted by x, then y, then z; those of the same x and y form a *row*. A *slot* is a point's place in the order of
/// blocks, then cells of a block, then the cloud: the points of neighbouring blocks of a row lie side by side.
#[derive(Debug, Default)]
pub(super) struct Grid {
    sort: CellSort,
    /// The rows, ascending by x, then y, and one more at the end that closes the last.
    rows: Vec<Row>,
    /// z index of each block.
    block_z: Vec<i32>,
    touching: Vec<TouchingBlocks>,
    /// First cell of each block, and the number of cells at the end.
    block_start: Vec<u32>,
    /// Which octant of its block each cell is.
    octant: Vec<u8>,
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
    first_block: u32,
}

impl Grid {
    /// Sorts a cloud into cells.
    pub(super) fn build(&mut self, eps: f32, points: &[Point]) {
        // Shorter by 2^-20, so that neither a cell's index nor the test in f32, both good to some 2^-22, parts two
        // points of a cell. Twice the side is more than eps.
        let side = f64::from(eps) / 3.0_f64.sqrt() * (1.0 - 1.0 / f64::from(1 << 20));
        let blocks = CubicLattice::new(2.0 * side);
        self.sort.sort(blocks, points);
        self.split_blocks(CubicLattice::new(side), points);
        self.find_rows(blocks);
        self.find_touching_blocks();
    }

    /// Sorts the points of each block by octant, and copies them.
    fn split_blocks(&mut self, cells: CubicLattice, points: &[Point]) {
        self.block_start.clear();
        self.octant.clear();
        self.cell_start.clear();
        self.point.resize(points.len(), 0);
        for values in [&mut self.x, &mut self.y, &mut self.z] {
            values.resize(points.len(), 0.0);
        }
        let mut start = 0;
        for block in 0..self.sort.cell_count() {
            let mut next_slot = [0; 8];
            for point in self.sort.runs_of_cell(block).flat_map(|run| &points[run]) {
                next_slot[octant(cells, *point)] += 1;
            }
            self.block_start.push(self.octant.len() as u32);
            for (octant, slot) in (0..).zip(&mut next_slot) {
                let count = std::mem::replace(slot, start);
                if count > 0 {
                    self.octant.push(octant);
                    self.cell_start.push(start);
                    start += count;
                }
            }
            for run in self.sort.runs_of_cell(block) {
                for (index, point) in (run.start as u32..).zip(&points[run]) {
                    let next = &mut next_slot[octant(cells, *point)];
                    let slot = *next as usize;
                    *next += 1;
                    self.point[slot] = index;
                    [self.x[slot], self.y[slot], self.z[slot]] = *point;
                }
            }
        }
        self.block_start.push(self.octant.len() as u32);
        self.cell_start.push(start);
        self.truncate_slots(start as usize);
    }

    fn find_rows(&mut self, blocks: CubicLattice) {
        self.rows.clear();
        self.block_z.clear();
        for block in 0..self.block_count() {
            let slot = self.cell_start[self.block_start[block] as usize] as usize;
            let (x, y) = (blocks.index(self.x[slot]), blocks.index(self.y[slot]));
            self.block_z.push(blocks.index(self.z[slot]));
            if self.rows.last().is_none_or(|row| (row.x, row.y) != (x, y)) {
                self.rows.push(Row { x, y, first_block: block as u32 });
            }
        }
        self.rows.push(Row { x: i32::MAX, y: i32::MAX, first_block: self.block_count() as u32 });
    }

    fn find_touching_blocks(&mut self) {
        let mut touching = std::mem::take(&mut self.touching);
        touching.clear();
        touching.resize(self.block_count(), TouchingBlocks::default());
        let share = task_size(touching.len());
        for_each(touching.chunks_mut(share).enumerate(), |(task, found)| {
            TouchingBlocks::find(self, task * share, found);
        });
        self.touching = touching;
    }

    /// The rows, ascending, without the closing one.
    #[inline]
    pub(super) fn rows(&self) -> &[Row] {
        self.rows.split_last().map_or(&[], |(_, rows)| rows)
    }

    /// The row that holds a block.
    pub(super) fn row_of_block(&self, block: usize) -> usize {
        self.rows().partition_point(|row| row.first_block as usize <= block).saturating_sub(1)
    }

    #[inline]
    pub(super) fn blocks_of_row(&self, row: usize) -> Range<usize> {
        self.rows[row].first_block as usize..self.rows[row + 1].first_block as usize
    }

    #[inline]
    pub(super) fn block_count(&self) -> usize {
        self.block_start.len().saturating_sub(1)
    }

    #[inline]
    pub(super) fn z_of_block(&self, block: usize) -> i32 {
        self.block_z[block]
    }

    /// The blocks of a neighbouring row that touch a block.
    #[inline]
    pub(super) fn touching(&self, block: usize, row: RowOffset) -> Range<usize> {
        self.touching[block].of_row(row)
    }

    /// The cells of successive blocks.
    #[inline]
    pub(super) fn cells_of_blocks(&self, blocks: Range<usize>) -> Range<usize> {
        self.block_start[blocks.start] as usize..self.block_start[blocks.end] as usize
    }

    #[inline]
    pub(super) fn cell_count(&self) -> usize {
        self.octant.len()
    }

    /// Which octant of its block a cell is: bit 2 is x, bit 1 y, bit 0 z.
    #[inline]
    pub(super) fn octant_of_cell(&self, cell: usize) -> u8 {
        self.octant[cell]
    }

    /// The slots of successive cells.
    #[inline]
    pub(super) fn slots_of_cells(&self, cells: Range<usize>) -> Range<usize> {
        self.cell_start[cells.start] as usize..self.cell_start[cells.end] as usize
    }

    /// Number of points in the grid.
    #[inline]
    pub(super) fn slot_count(&self) -> usize {
        self.point.len()
    }

    /// Indices into the cloud of a cell's points, ascending.
    #[inline]
    pub(super) fn point_indices(&self, cell: usize) -> &[u32] {
        &self.point[self.slots_of_cells(cell..cell + 1)]
    }

    /// The points of successive cells.
    #[inline]
    pub(super) fn run(&self, cells: Range<usize>) -> Run<'_> {
        let slots = self.slots_of_cells(cells);
        Run { x: &self.x[slots.clone()], y: &self.y[slots.clone()], z: &self.z[slots] }
    }

    /// Keeps the points whose slots `keep` approves, and all cells, some of them empty now; calls `removed` for each
    /// other point with its block and its index into the cloud, in the order of the slots.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool, mut removed: impl FnMut(usize, u32)) {
        let mut end = 0;
        for block in 0..self.block_count() {
            for cell in self.cells_of_blocks(block..block + 1) {
                let slots = self.slots_of_cells(cell..cell + 1);
                self.cell_start[cell] = end as u32;
                for slot in slots {
                    if keep(slot) {
                        self.point[end] = self.point[slot];
                        [self.x[end], self.y[end], self.z[end]] = [self.x[slot], self.y[slot], self.z[slot]];
                        end += 1;
                    } else {
                        removed(block, self.point[slot]);
                    }
                }
            }
        }
        if let Some(last) = self.cell_start.last_mut() {
            *last = end as u32;
        }
        self.truncate_slots(end);
    }

    fn truncate_slots(&mut self, end: usize) {
        self.point.truncate(end);
        for values in [&mut self.x, &mut self.y, &mut self.z] {
            values.truncate(end);
        }
    }
}

/// Which octant of its block a point lies in: bit 2 is x, bit 1 y, bit 0 z.
///
/// Beyond the counted blocks, where all points of a block are equal, any octant will do.
#[inline]
fn octant(cells: CubicLattice, point: Point) -> usize {
    let [x, y, z] = point.map(|x| cells.parity(x));
    x << 2 | y << 1 | z
}

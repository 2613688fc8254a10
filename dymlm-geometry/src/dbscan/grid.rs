use std::ops::Range;

use dymlm_core::Point;

use super::rows::{Row, Rows};
use super::run::Run;
use super::touching_blocks::{RowOffset, TouchingBlocks};
use crate::lattice::{CellSort, CubicLattice};
use crate::parallel::{for_each, task_size};

/// The points in *cells* with a diagonal of eps, eight of which make a *block*, two along each axis.
///
/// Points of a cell are within eps of each other, and points within eps of each other lie in blocks that
/// touch. Blocks are sorted by x, then y, then z; those of the same x and y form a *row*. A *slot* is a
/// point's place in the order of blocks, then cells of a block, then the cloud: the points of neighbouring
/// blocks of a row lie side by side.
#[derive(Debug, Default)]
pub(super) struct Grid {
    sort: CellSort,
    rows: Rows,
    touching: Vec<TouchingBlocks>,
    /// First cell of each block, and the number of cells at the end.
    block_start: Vec<u32>,
    /// Which octant of its block each cell is.
    octant: Vec<u8>,
    /// First slot of each cell, and the number of slots at the end.
    cell_start: Vec<u32>,
    /// Index into the cloud of each slot.
    point: Vec<u32>,
    /// Coordinates of each slot, and [`Run::PADDING`] values after them.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Which octant of its block each point is in, for one block.
    octants: Vec<u8>,
}

impl Grid {
    /// Sorts a cloud into cells.
    pub(super) fn build(&mut self, eps: f32, points: &[Point]) {
        // Shorter by 2^-20, so that neither a cell's border nor the test in f32, both good to some 2^-22,
        // separates two points of a cell. Twice the side is more than eps.
        let side = f64::from(eps) / 3.0_f64.sqrt() * (1.0 - 1.0 / f64::from(1 << 20));
        let blocks = CubicLattice::new(2.0 * side);
        self.sort.sort(blocks, points);
        self.find_rows(blocks, points);
        self.split_blocks(side, points);
        self.find_touching_blocks();
    }

    fn find_rows(&mut self, blocks: CubicLattice, points: &[Point]) {
        let first_point = |block| self.sort.runs_of_cell(block).next().map(|run| points[run.start]);
        let firsts = (0..self.sort.cell_count()).filter_map(first_point);
        self.rows.fill(firsts.map(|point| point.map(|x| blocks.index(x))));
    }

    /// Sorts the points of each block by octant, and copies them.
    fn split_blocks(&mut self, side: f64, points: &[Point]) {
        self.block_start.clear();
        self.octant.clear();
        self.cell_start.clear();
        self.resize_slots(points.len());
        let mut start = 0;
        for row in 0..self.rows.all().len() {
            let Row { x, y, .. } = self.rows.all()[row];
            for block in self.rows.blocks_of_row(row) {
                let index = [x, y, self.rows.z_of_block(block)];
                // Beyond the counted blocks this is no centre; but there all points of a block are equal.
                let center = index.map(|index| f64::from(index) * 2.0 * side + side);
                start = self.split_block(block, center, start, points);
            }
        }
        self.block_start.push(self.octant.len() as u32);
        self.cell_start.push(start);
        self.resize_slots(start as usize);
    }

    /// Sorts the points of a block by octant into the slots from `start` on. Returns the slot after the last.
    fn split_block(&mut self, block: usize, center: [f64; 3], start: u32, points: &[Point]) -> u32 {
        let mut next_slot = [0; 8];
        self.octants.clear();
        for point in self.sort.runs_of_cell(block).flat_map(|run| &points[run]) {
            let octant = octant(center, *point);
            next_slot[usize::from(octant)] += 1;
            self.octants.push(octant);
        }
        self.block_start.push(self.octant.len() as u32);
        let mut end = start;
        for (octant, slot) in (0..).zip(&mut next_slot) {
            let count = std::mem::replace(slot, end);
            if count > 0 {
                self.octant.push(octant);
                self.cell_start.push(end);
                end += count;
            }
        }
        let mut octants = self.octants.iter();
        for run in self.sort.runs_of_cell(block) {
            for ((index, point), &octant) in (run.start as u32..).zip(&points[run]).zip(&mut octants) {
                let next = &mut next_slot[usize::from(octant)];
                let slot = *next as usize;
                *next += 1;
                self.point[slot] = index;
                [self.x[slot], self.y[slot], self.z[slot]] = *point;
            }
        }
        end
    }

    fn find_touching_blocks(&mut self) {
        self.touching.clear();
        self.touching.resize(self.block_count(), TouchingBlocks::default());
        let share = task_size(self.touching.len());
        for_each(self.touching.chunks_mut(share).enumerate(), |(task, found)| {
            TouchingBlocks::find(&self.rows, task * share, found);
        });
    }

    #[inline]
    pub(super) fn block_count(&self) -> usize {
        self.block_start.len().saturating_sub(1)
    }

    #[inline]
    pub(super) fn z_of_block(&self, block: usize) -> i32 {
        self.rows.z_of_block(block)
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
        Run::new([&self.x, &self.y, &self.z], slots)
    }

    /// Keeps the points for whose slots `keep` is true, and the cells that still hold some; calls `removed`
    /// for each other point with its block and its index into the cloud, in the order of the slots.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool, mut removed: impl FnMut(usize, u32)) {
        let (mut kept_cells, mut kept_slots) = (0, 0);
        for block in 0..self.block_count() {
            let cells = self.cells_of_blocks(block..block + 1);
            self.block_start[block] = kept_cells as u32;
            for cell in cells {
                let first = kept_slots;
                for slot in self.slots_of_cells(cell..cell + 1) {
                    if keep(slot) {
                        self.point[kept_slots] = self.point[slot];
                        for values in [&mut self.x, &mut self.y, &mut self.z] {
                            values[kept_slots] = values[slot];
                        }
                        kept_slots += 1;
                    } else {
                        removed(block, self.point[slot]);
                    }
                }
                if kept_slots > first {
                    self.octant[kept_cells] = self.octant[cell];
                    self.cell_start[kept_cells] = first as u32;
                    kept_cells += 1;
                }
            }
        }
        if let Some(last) = self.block_start.last_mut() {
            *last = kept_cells as u32;
        }
        self.octant.truncate(kept_cells);
        self.cell_start.truncate(kept_cells);
        self.cell_start.push(kept_slots as u32);
        self.resize_slots(kept_slots);
    }

    fn resize_slots(&mut self, count: usize) {
        self.point.resize(count, 0);
        for values in [&mut self.x, &mut self.y, &mut self.z] {
            values.resize(count + Run::PADDING, 0.0);
        }
    }
}

/// Which octant of its block a point lies in: bit 2 is x, bit 1 y, bit 0 z.
#[inline]
fn octant(center: [f64; 3], point: Point) -> u8 {
    let [x, y, z] = std::array::from_fn(|axis| u8::from(f64::from(point[axis]) >= center[axis]));
    x << 2 | y << 1 | z
}

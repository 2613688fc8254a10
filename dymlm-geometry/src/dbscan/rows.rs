use std::ops::Range;

/// Blocks of a lattice in rows: a row has the blocks of the same x and y, ascending by z; rows ascend by x,
/// then y.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// The rows, and one more at the end that closes the last.
    rows: Vec<Row>,
    /// z index of each block.
    block_z: Vec<i32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) x: i32,
    pub(super) y: i32,
    first_block: u32,
}

impl Rows {
    /// Takes blocks, which ascend by their indices of x, then y, then z.
    pub(super) fn fill(&mut self, blocks: impl Iterator<Item = [i32; 3]>) {
        self.rows.clear();
        self.block_z.clear();
        for [x, y, z] in blocks {
            if self.rows.last().is_none_or(|row| (row.x, row.y) != (x, y)) {
                self.rows.push(Row { x, y, first_block: self.block_z.len() as u32 });
            }
            self.block_z.push(z);
        }
        self.rows.push(Row { x: i32::MAX, y: i32::MAX, first_block: self.block_z.len() as u32 });
    }

    /// The rows, ascending, without the closing one.
    #[inline]
    pub(super) fn all(&self) -> &[Row] {
        self.rows.split_last().map_or(&[], |(_, rows)| rows)
    }

    /// The row that holds a block.
    pub(super) fn row_of_block(&self, block: usize) -> usize {
        self.all().partition_point(|row| row.first_block as usize <= block).saturating_sub(1)
    }

    #[inline]
    pub(super) fn blocks_of_row(&self, row: usize) -> Range<usize> {
        self.rows[row].first_block as usize..self.rows[row + 1].first_block as usize
    }

    #[inline]
    pub(super) fn z_of_block(&self, block: usize) -> i32 {
        self.block_z[block]
    }
}

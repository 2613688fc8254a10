use std::ops::Range;

use dymlm_core::PinholeCamera;

/// The image divided into square blocks, row by row; the last block of a row or column may be smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct BlockGrid {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) side: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
}

/// Least side of a block, pixels: fewer than 16 points do not define a plane well.
pub(crate) const SMALLEST_BLOCK: usize = 4;
/// Largest side of a block, pixels: a row fits in the bits of a `u64`.
pub(super) const LARGEST_SIDE: usize = 64;

impl BlockGrid {
    pub(super) fn new(camera: &PinholeCamera, block_size: usize) -> Self {
        let (width, height) = (camera.width(), camera.height());
        let side = (block_size as f64 * camera.focal_scale()).round() as usize;
        let side = side.clamp(SMALLEST_BLOCK, LARGEST_SIDE);
        Self { width, height, side, columns: width.div_ceil(side), rows: height.div_ceil(side) }
    }

    pub(super) fn len(&self) -> usize {
        self.columns * self.rows
    }

    pub(super) fn pixel_columns(&self, block: usize) -> Range<usize> {
        let first = block % self.columns * self.side;
        first..(first + self.side).min(self.width)
    }

    pub(super) fn pixel_rows(&self, block: usize) -> Range<usize> {
        let first = block / self.columns * self.side;
        first..(first + self.side).min(self.height)
    }

    pub(super) fn area(&self, block: usize) -> usize {
        self.pixel_columns(block).len() * self.pixel_rows(block).len()
    }

    /// The neighbours of a block: left, right, above and below.
    pub(super) fn neighbors(&self, block: usize) -> [Option<usize>; 4] {
        let (column, row) = (block % self.columns, block / self.columns);
        [
            (column > 0).then(|| block - 1),
            (column + 1 < self.columns).then_some(block + 1),
            (row > 0).then(|| block - self.columns),
            (row + 1 < self.rows).then_some(block + self.columns),
        ]
    }
}

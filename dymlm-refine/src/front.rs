use crate::elimination::Run;

/// Columns that are subtracted from the rest at once: their part of a tile's rows stays in the nearest cache.
const PANEL: usize = 24;
/// Rows and columns of a tile, as many as fit into registers.
const TILE: usize = 4;

/// A dense symmetric matrix whose first columns are eliminated. Only its lower triangle is used. Stored
/// column by column.
///
/// Plain loops: the same operations in the same order on every processor.
#[derive(Debug, Default)]
pub(crate) struct Front {
    size: usize,
    values: Vec<f64>,
    /// Rows of a panel, tile by tile.
    tiles: Vec<[f64; TILE]>,
}

impl Front {
    /// Sets the size, and all numbers of the lower triangle to zero.
    pub(crate) fn clear(&mut self, size: usize) {
        self.size = size;
        self.values.resize(size * size, 0.0);
        for (above, column) in self.values.chunks_exact_mut(size.max(1)).enumerate() {
            column[above..].fill(0.0);
        }
    }

    /// A column from a row on.
    pub(crate) fn column_mut(&mut self, column: usize, row: usize) -> &mut [f64] {
        &mut self.values[column * self.size + row..(column + 1) * self.size]
    }

    /// The first columns.
    pub(crate) fn columns(&self, columns: usize) -> &[f64] {
        &self.values[..columns * self.size]
    }

    /// The matrix that remains behind so many columns, column by column.
    pub(crate) fn rest(&self, columns: usize) -> impl Iterator<Item = &[f64]> {
        let columns = columns.min(self.size);
        self.values.chunks_exact(self.size.max(1)).skip(columns).map(move |column| &column[columns..])
    }

    /// Adds a matrix of `size` rows, given column by column; `runs` says where its rows go.
    pub(crate) fn add(&mut self, matrix: &[f64], size: usize, runs: &[Run]) {
        for (first, columns) in runs.iter().enumerate() {
            for k in 0..columns.length {
                let from = &matrix[(columns.from + k) * size..][..size];
                let to = self.column_mut(columns.to + k, 0);
                for (number, rows) in runs[first..].iter().enumerate() {
                    // Within the run itself, only what is below the diagonal.
                    let above = if number == 0 { k } else { 0 };
                    let (from, to) = (&from[rows.from..][above..rows.length], &mut to[rows.to + above..]);
                    for (sum, number) in to.iter_mut().zip(from) {
                        *sum += number;
                    }
                }
            }
        }
    }

    /// Eliminates the first columns: they become columns of the Cholesky factor, and the rest becomes its
    /// Schur complement. `false` when the matrix is not positive definite.
    pub(crate) fn eliminate(&mut self, columns: usize) -> bool {
        for begin in (0..columns).step_by(PANEL) {
            let end = columns.min(begin + PANEL);
            if !self.factorize_panel(begin, end) {
                return false;
            }
            self.subtract_panel(begin, end);
        }
        true
    }

    fn factorize_panel(&mut self, begin: usize, end: usize) -> bool {
        let size = self.size;
        for j in begin..end {
            let (column, later) = self.values[j * size..end * size].split_at_mut(size);
            let root = column[j].sqrt();
            if root.is_nan() || root <= 0.0 {
                return false;
            }
            let inverse = 1.0 / root;
            column[j] = root;
            for number in &mut column[j + 1..] {
                *number *= inverse;
            }
            for (number, other) in later.chunks_exact_mut(size).enumerate() {
                let k = j + 1 + number;
                let factor = column[k];
                for (number, own) in other[k..].iter_mut().zip(&column[k..]) {
                    *number -= factor * own;
                }
            }
        }
        true
    }

    /// Subtracts the product of the panel with itself from the columns to the right of it.
    fn subtract_panel(&mut self, begin: usize, end: usize) {
        let (size, width) = (self.size, end - begin);
        let (panel, rest) = self.values.split_at_mut(end * size);
        let tiles = (size - end).div_ceil(TILE);
        self.tiles.clear();
        self.tiles.resize(tiles * width, [0.0; TILE]);
        for (k, column) in panel[begin * size..].chunks_exact(size).enumerate() {
            for (tile, rows) in column[end..].chunks(TILE).enumerate() {
                self.tiles[tile * width + k][..rows.len()].copy_from_slice(rows);
            }
        }
        for (first, columns) in rest.chunks_mut(TILE * size).enumerate() {
            let right = &self.tiles[first * width..][..width];
            for (tile, left) in self.tiles.chunks_exact(width).enumerate().skip(first) {
                let product = product(left, right);
                let row = end + tile * TILE;
                for (column, product) in columns.chunks_exact_mut(size).zip(&product) {
                    // The last tile may have fewer rows.
                    for (number, product) in column[row..].iter_mut().zip(product) {
                        *number -= product;
                    }
                }
            }
        }
    }
}

/// Product of a tile's rows with another tile's, transposed; by columns.
fn product(left: &[[f64; TILE]], right: &[[f64; TILE]]) -> [[f64; TILE]; TILE] {
    let mut product = [[0.0; TILE]; TILE];
    for (left, right) in left.iter().zip(right) {
        for (column, right) in product.iter_mut().zip(right) {
            for (number, left) in column.iter_mut().zip(left) {
                *number += left * right;
            }
        }
    }
    product
}

use std::ops::Range;

/// The foreground of a box: depths of the mover's surface on a grid of cells, each `stride` pixels a side.
///
/// The buffer is the caller's to keep: filled again for each box, it allocates only to grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Foreground {
    pub(super) stride: usize,
    pub(super) first_column: usize,
    pub(super) first_row: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Depth of each cell; 0 = not of the foreground.
    pub(super) depths: Vec<f32>,
    pub(super) count: usize,
    /// Those in the box, of how many.
    pub(super) box_count: usize,
    pub(super) box_cells: usize,
    pub(super) near: f32,
    pub(super) median: f32,
    pub(super) far: f32,
    pub(super) max_step: f32,
}

impl Foreground {
    /// No foreground, to be filled by [`ForegroundFinder::find`](crate::ForegroundFinder::find).
    pub fn new() -> Self {
        Self::default()
    }

    /// Whether nothing was found.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Median depth, metres; `None` when there is no foreground.
    #[inline]
    pub fn depth(&self) -> Option<f32> {
        (!self.is_empty()).then_some(self.median)
    }

    /// Share of the box's cells that are foreground, 0..=1.
    pub fn fill(&self) -> f32 {
        if self.box_cells == 0 { 0.0 } else { self.box_count as f32 / self.box_cells as f32 }
    }

    /// Whether a pixel of depth `z` > 0 lies on the foreground's surface: a cell around it holds about that depth.
    #[inline]
    pub fn holds(&self, u: usize, v: usize, z: f32) -> bool {
        if self.is_empty() {
            return false;
        }
        // One cell is added on each side, so that subtraction cannot go below zero.
        let (column, row) = (u / self.stride + 1, v / self.stride + 1);
        let columns = Self::neighbours(column, self.first_column, self.columns);
        let rows = Self::neighbours(row, self.first_row, self.rows);
        rows.into_iter().any(|row| {
            let cells = self.depths.get(row * self.columns + columns.start..row * self.columns + columns.end);
            cells.unwrap_or(&[]).iter().any(|&depth| self.continues(depth, z))
        })
    }

    /// The first and the last column and row that were found to be foreground; `None` when nothing was found.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        let (mut bounds, mut any) =
            (Bounds { left: usize::MAX, right: 0, top: usize::MAX, bottom: 0 }, false);
        for (row, depths) in self.depths.chunks_exact(self.columns.max(1)).enumerate() {
            let Some(first) = depths.iter().position(|&depth| depth > 0.0) else { continue };
            let last = depths.iter().rposition(|&depth| depth > 0.0).unwrap_or(first);
            let pixel = |cell: usize| cell * self.stride + self.stride / 2;
            bounds.left = bounds.left.min(pixel(self.first_column + first));
            bounds.right = bounds.right.max(pixel(self.first_column + last));
            bounds.top = bounds.top.min(pixel(self.first_row + row));
            bounds.bottom = bounds.bottom.max(pixel(self.first_row + row));
            any = true;
        }
        any.then_some(bounds)
    }

    /// The cells near which the foreground's surface runs.
    pub(crate) fn patches(&self) -> impl Iterator<Item = Patch> + '_ {
        let rows = self.first_row.saturating_sub(1)..=self.first_row + self.rows;
        rows.flat_map(move |row| {
            let columns = self.first_column.saturating_sub(1)..=self.first_column + self.columns;
            columns.map(move |column| self.patch(column, row))
        })
        .filter(|patch| patch.count > 0)
    }

    fn patch(&self, column: usize, row: usize) -> Patch {
        let mut patch = Patch {
            columns: column * self.stride..(column + 1) * self.stride,
            rows: row * self.stride..(row + 1) * self.stride,
            depths: [0.0; 9],
            count: 0,
            max_step: self.max_step,
        };
        let near = Self::neighbours(column + 1, self.first_column, self.columns);
        for row in Self::neighbours(row + 1, self.first_row, self.rows) {
            for &depth in &self.depths[row * self.columns..][near.clone()] {
                if depth > 0.0 {
                    patch.depths[patch.count] = depth;
                    patch.count += 1;
                }
            }
        }
        patch
    }

    /// Whether two readings can be neighbours on one surface. A depth of 0 is none.
    #[inline]
    pub fn continues(&self, a: f32, b: f32) -> bool {
        continues(a, b, self.max_step)
    }

    /// Whether a depth lies within reach of the foreground.
    #[inline]
    pub fn reaches(&self, z: f32) -> bool {
        (self.near..=self.far).contains(&z)
    }

    /// The cells around cell `index` (counted from 1) of a grid that begins at `first` and has `count` cells.
    #[inline]
    fn neighbours(index: usize, first: usize, count: usize) -> Range<usize> {
        let end = (index + 1).saturating_sub(first).min(count);
        let start = index.saturating_sub(first + 2).min(end);
        start..end
    }
}

/// Outermost sampled pixels of a foreground, inclusive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) top: usize,
    pub(crate) bottom: usize,
}

/// The pixels of one cell, and the depths of the foreground in and around it.
#[derive(Debug, Clone)]
pub(crate) struct Patch {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    depths: [f32; 9],
    count: usize,
    max_step: f32,
}

impl Patch {
    /// Whether a pixel of the cell lies on the foreground's surface. A depth of 0 does not.
    #[inline]
    pub(crate) fn holds(&self, z: f32) -> bool {
        z > 0.0 && self.depths.iter().take(self.count).any(|&depth| continues(depth, z, self.max_step))
    }
}

#[inline]
fn continues(a: f32, b: f32, max_step: f32) -> bool {
    (a - b).abs() <= max_step * a.min(b)
}

use std::ops::Range;

use dymlm_core::{BoundingBox, SensorModel};
use dymlm_geometry::SampleGrid;

use super::background::{Background, PlanesNear};

/// The foreground of a box: depths of the mover's surface on a grid of square cells of `stride` pixels.
///
/// Reuse the buffer for each box: filling it again allocates only when it must grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Foreground {
    stride: usize,
    /// Column and row of the first cell's first pixel.
    first: [usize; 2],
    columns: usize,
    rows: usize,
    /// Depth of each cell; 0 = not of the foreground.
    depths: Vec<f32>,
    count: usize,
    /// How likely it is the mover of its box: 0..=1.
    pub(super) likelihood: f32,
    /// Least, median and greatest depth of its surface, metres.
    near: f32,
    median: f32,
    far: f32,
    /// Greatest change of depth between neighbouring pixels of its surface, as a share of the depth.
    max_step: f32,
    /// Planes that continue from the box into its surroundings: never part of the foreground.
    pub(super) background: Background,
}

/// Standard deviation of the change of a surface's depth between neighbouring pixels, in units of their
/// distance on a surface that faces the camera. Lower values cut a person's flanks off the body, higher ones
/// join people and furniture.
const SLOPE_SIGMA: f64 = 3.0;

impl Foreground {
    /// Resets it to an empty foreground on a grid.
    pub(super) fn clear(&mut self, grid: &SampleGrid) {
        (self.stride, self.first) = (grid.stride, grid.first);
        (self.columns, self.rows) = (grid.columns, grid.rows);
        self.depths.clear();
        self.depths.resize(grid.columns * grid.rows, 0.0);
        (self.count, self.likelihood) = (0, 0.0);
    }

    /// Starts the range of depths at the surface's median depth.
    pub(super) fn start(&mut self, median: f32) {
        (self.near, self.median, self.far) = (median, median, median);
    }

    /// Adds a cell.
    pub(super) fn add(&mut self, column: usize, row: usize, z: f32) {
        self.depths[row * self.columns + column] = z;
        self.count += 1;
        (self.near, self.far) = (self.near.min(z), self.far.max(z));
    }

    /// Sets how much neighbouring pixels may differ in depth: by the noise at the foreground's depth, and by
    /// the change of a surface's depth from pixel to pixel. `pitch` is the distance of neighbouring pixels at
    /// a depth of 1 m, metres.
    pub(super) fn set_step(&mut self, sensor: &SensorModel, pitch: f64) {
        let z = self.median;
        self.max_step = if self.is_empty() {
            0.0
        } else {
            sensor.tolerance(z, SLOPE_SIGMA * pitch * f64::from(z)) as f32 / z
        };
    }

    /// How likely it is the mover of its box: 0..=1.
    pub(crate) fn likelihood(&self) -> f32 {
        self.likelihood
    }

    /// Whether most of its cells lie on another foreground's surface.
    pub(crate) fn is_mostly_on(&self, other: &Self) -> bool {
        let pixel = |cell: usize, first: usize| first + cell * self.stride + self.stride / 2;
        // Stops as soon as it is decided: most other foregrounds are elsewhere.
        let (mut on_other, mut left) = (0, self.count);
        for (cell, &depth) in self.depths.iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
            let [u, v] =
                [pixel(cell % self.columns, self.first[0]), pixel(cell / self.columns, self.first[1])];
            on_other += usize::from(other.holds(u, v, depth));
            left -= 1;
            if 2 * on_other > self.count || 2 * (on_other + left) <= self.count {
                break;
            }
        }
        2 * on_other > self.count
    }

    /// Whether nothing was found.
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Median depth, metres; `None` when there is no foreground.
    #[inline]
    pub(crate) fn depth(&self) -> Option<f32> {
        (!self.is_empty()).then_some(self.median)
    }

    /// Whether a pixel of depth `z` > 0 lies on the foreground's surface: its cell or a neighbouring one has
    /// about that depth.
    #[inline]
    pub(crate) fn holds(&self, u: usize, v: usize, z: f32) -> bool {
        if self.is_empty() {
            return false;
        }
        let [first_column, first_row] = self.first;
        // One cell is added on each side, so that subtraction cannot go below zero.
        let (Some(u), Some(v)) =
            ((u + self.stride).checked_sub(first_column), (v + self.stride).checked_sub(first_row))
        else {
            return false;
        };
        let columns = around(u / self.stride, self.columns);
        around(v / self.stride, self.rows).any(|row| {
            let cells = self.depths.get(row * self.columns + columns.start..row * self.columns + columns.end);
            cells.unwrap_or(&[]).iter().any(|&depth| self.continues(depth, z))
        })
    }

    /// Whether a reading belongs to a plane that continues from the box into its surroundings.
    #[inline]
    pub(crate) fn is_background(&self, u: usize, v: usize, z: f32) -> bool {
        let cell = |pixel: usize, first: usize| Some(pixel.checked_sub(first)? / self.stride.max(1));
        match (cell(u, self.first[0]), cell(v, self.first[1])) {
            (Some(column), Some(row)) => self.background.planes_near(column, row).hold(u, v, z),
            _ => false,
        }
    }

    /// The cells in which readings of the background may lie.
    pub(crate) fn background_cells(&self) -> impl Iterator<Item = BackgroundCell<'_>> {
        let cells = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| [column, row]));
        let near = cells.map(|cell| (cell, self.background.planes_near(cell[0], cell[1])));
        near.filter(|(_, planes)| !planes.is_empty()).map(|(cell, planes)| {
            let pixels = |axis: usize| {
                let start = self.first[axis] + cell[axis] * self.stride;
                start..start + self.stride
            };
            BackgroundCell { columns: pixels(0), rows: pixels(1), planes }
        })
    }

    /// The first and last column and row of the foreground; `None` when it is empty.
    pub(crate) fn bounds(&self) -> Option<Bounds> {
        let (mut bounds, mut any) =
            (Bounds { left: usize::MAX, right: 0, top: usize::MAX, bottom: 0 }, false);
        for (row, depths) in self.depths.chunks_exact(self.columns.max(1)).enumerate() {
            let Some(first) = depths.iter().position(|&depth| depth > 0.0) else { continue };
            let last = depths.iter().rposition(|&depth| depth > 0.0).unwrap_or(first);
            let pixel = |cell: usize, first: usize| first + cell * self.stride + self.stride / 2;
            bounds.left = bounds.left.min(pixel(first, self.first[0]));
            bounds.right = bounds.right.max(pixel(last, self.first[0]));
            bounds.top = bounds.top.min(pixel(row, self.first[1]));
            bounds.bottom = bounds.bottom.max(pixel(row, self.first[1]));
            any = true;
        }
        any.then_some(bounds)
    }

    /// The box around all cells of the foreground, pixels; `None` when it is empty.
    pub(crate) fn bounding_box(&self) -> Option<BoundingBox> {
        let Bounds { left, right, top, bottom } = self.bounds()?;
        BoundingBox::new(left as f32, top as f32, (right + 1) as f32, (bottom + 1) as f32).ok()
    }

    /// The cells that hold, or adjoin, a part of the foreground's surface.
    pub(crate) fn patches(&self) -> impl Iterator<Item = Patch> + '_ {
        let rows = 0..self.rows + 2;
        rows.flat_map(move |row| (0..self.columns + 2).map(move |column| self.patch(column, row)))
            .filter(|patch| patch.count > 0)
    }

    /// The patch of a cell; columns and rows are counted from 1, so that 0 is the cell before the grid.
    fn patch(&self, column: usize, row: usize) -> Patch {
        let pixels = |cell: usize, first: usize| {
            let end = first + cell * self.stride;
            end.saturating_sub(self.stride)..end
        };
        let mut patch = Patch {
            columns: pixels(column, self.first[0]),
            rows: pixels(row, self.first[1]),
            depths: [0.0; 9],
            count: 0,
            max_step: self.max_step,
        };
        let near = around(column, self.columns);
        for row in around(row, self.rows) {
            for &depth in &self.depths[row * self.columns..][near.clone()] {
                if depth > 0.0 {
                    patch.depths[patch.count] = depth;
                    patch.count += 1;
                }
            }
        }
        patch
    }

    /// Whether two readings can be neighbours on one surface. A depth of 0 continues nothing.
    #[inline]
    pub(crate) fn continues(&self, a: f32, b: f32) -> bool {
        continues(a, b, self.max_step)
    }

    /// Whether a depth lies within the foreground's range of depths.
    #[inline]
    pub(crate) fn reaches(&self, z: f32) -> bool {
        (self.near..=self.far).contains(&z)
    }
}

/// The cells next to a cell, and itself, in a row of `count` cells. `cell` is counted from 1.
#[inline]
fn around(cell: usize, count: usize) -> Range<usize> {
    let end = (cell + 1).min(count);
    cell.saturating_sub(2).min(end)..end
}

/// Outermost sampled pixels of a foreground, inclusive.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bounds {
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) top: usize,
    pub(crate) bottom: usize,
}

/// The pixels of one cell, and the background planes in and around it.
#[derive(Debug)]
pub(crate) struct BackgroundCell<'a> {
    pub(crate) columns: Range<usize>,
    pub(crate) rows: Range<usize>,
    pub(crate) planes: PlanesNear<'a>,
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

use std::num::NonZero;

use dymlm_core::vector3::{along, cross, difference, dot, unit};

/// A piece of a plane divided into rectangular cells. Coordinates run along two axes, from 0 to the extents.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CellRaster {
    corner: [f64; 3],
    /// Unit vectors in the plane; the normal is their cross product.
    axes: [[f64; 3]; 2],
    /// Sides of a cell, metres.
    cell: [f64; 2],
    columns: NonZero<u16>,
    rows: NonZero<u16>,
}

/// Largest number of cells along an axis: larger faces get larger cells.
const MOST_CELLS: u16 = 2000;

impl CellRaster {
    /// Cells of about `cell` metres over the bounds of points of a plane that contains the direction
    /// `along_u`. The sides of the cells are adapted so that whole cells fill the bounds: the cells of a
    /// rectangle with a side along `along_u` have exactly its area. `None` when the points span no area or
    /// are not finite.
    pub fn around(
        points: impl Iterator<Item = [f64; 3]>,
        normal: [f64; 3],
        along_u: [f64; 3],
        cell: f64,
    ) -> Option<Self> {
        let mut points = points.peekable();
        let origin = *points.peek()?;
        let u = unit(along(along_u, -dot(along_u, normal), normal))?;
        let axes = [u, cross(normal, u)];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in points {
            for (k, axis) in axes.iter().enumerate() {
                let at = dot(difference(point, origin), *axis);
                low[k] = low[k].min(at);
                high[k] = high[k].max(at);
            }
        }
        let extents = [high[0] - low[0], high[1] - low[1]];
        // A cell that is no number is not greater than 0 either.
        if !(cell > 0.0 && extents.iter().all(|&extent| extent > 0.0 && extent.is_finite())) {
            return None;
        }
        let counts = extents.map(|extent| (extent / cell).round().clamp(1.0, MOST_CELLS.into()));
        let (columns, rows) = (NonZero::new(counts[0] as u16)?, NonZero::new(counts[1] as u16)?);
        let corner = along(along(origin, low[0], axes[0]), low[1], axes[1]);
        corner.iter().all(|c| c.is_finite()).then_some(Self {
            corner,
            axes,
            cell: [extents[0] / counts[0], extents[1] / counts[1]],
            columns,
            rows,
        })
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Always `false`: a raster has at least one cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns.get().into()
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows.get().into()
    }

    /// Sides of a cell, metres.
    pub(crate) fn cell(&self) -> [f64; 2] {
        self.cell
    }

    /// Area of a cell, square metres.
    pub fn cell_area(&self) -> f64 {
        self.cell[0] * self.cell[1]
    }

    /// The first corner and the axes.
    pub fn frame(&self) -> ([f64; 3], [[f64; 3]; 2]) {
        (self.corner, self.axes)
    }

    /// The raster in another frame: `turn` transforms directions and `place` points.
    #[must_use]
    pub fn moved(&self, place: impl Fn([f64; 3]) -> [f64; 3], turn: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self { corner: place(self.corner), axes: self.axes.map(turn), ..self.clone() }
    }

    /// A point's coordinates along the axes, metres from the corner; its distance from the plane is dropped.
    #[inline]
    pub fn coordinates(&self, point: [f64; 3]) -> [f64; 2] {
        let offset = difference(point, self.corner);
        [dot(offset, self.axes[0]), dot(offset, self.axes[1])]
    }

    /// The cell that contains a point with these coordinates.
    #[inline]
    pub fn cell_at(&self, [u, v]: [f64; 2]) -> Option<usize> {
        let (column, row) = (u / self.cell[0], v / self.cell[1]);
        let inside =
            column >= 0.0 && column < self.columns() as f64 && row >= 0.0 && row < self.rows() as f64;
        inside.then(|| row as usize * self.columns() + column as usize)
    }

    /// The middle of a cell.
    #[inline]
    pub fn center(&self, cell: usize) -> [f64; 3] {
        let u = ((cell % self.columns()) as f64 + 0.5) * self.cell[0];
        let v = ((cell / self.columns()) as f64 + 0.5) * self.cell[1];
        along(along(self.corner, u, self.axes[0]), v, self.axes[1])
    }

    /// A corner of cells; `column` and `row` are counted from the first corner.
    pub(crate) fn corner_at(&self, column: usize, row: usize) -> [f64; 3] {
        let (u, v) = (column as f64 * self.cell[0], row as f64 * self.cell[1]);
        along(along(self.corner, u, self.axes[0]), v, self.axes[1])
    }

    /// The cells whose middles are within polygons, after projection onto the plane, by the even-odd rule
    /// over all rings (so a ring within a ring is a hole). Points that are not finite are left out of their
    /// rings.
    ///
    /// O(cells + sum of the rows that each edge spans).
    pub fn fill(&self, rings: &[Vec<[f64; 3]>]) -> Vec<bool> {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); self.rows()];
        for ring in rings {
            let finite = ring.iter().filter(|point| point.iter().all(|c| c.is_finite()));
            let corners: Vec<[f64; 2]> = finite.map(|&point| self.coordinates(point)).collect();
            let next = corners.iter().cycle().skip(1);
            for (&from, &to) in corners.iter().zip(next) {
                self.cross_rows(from, to, &mut crossings);
            }
        }
        let mut filled = vec![false; self.len()];
        for (crossings, row) in crossings.iter_mut().zip(filled.chunks_mut(self.columns())) {
            crossings.sort_unstable_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                // A middle exactly on a crossing belongs to the part after it.
                let [first, end] = [pair[0], pair[1]]
                    .map(|u| ((u / self.cell[0] - 0.5).ceil().max(0.0) as usize).min(self.columns()));
                row[first..end.max(first)].fill(true);
            }
        }
        filled
    }

    /// The cells whose middles are within at least one of several polygons, which may touch or overlap.
    pub fn fill_any(&self, pieces: &[Vec<[f64; 3]>]) -> Vec<bool> {
        let mut inside = vec![false; self.len()];
        for piece in pieces {
            let filled = self.fill(std::slice::from_ref(piece));
            inside.iter_mut().zip(filled).for_each(|(inside, filled)| *inside |= filled);
        }
        inside
    }

    /// Adds the places where an edge crosses the middle lines of the rows.
    fn cross_rows(&self, from: [f64; 2], to: [f64; 2], crossings: &mut [Vec<f64>]) {
        let (lower, upper) = if from[1] <= to[1] { (from, to) } else { (to, from) };
        let row_after = |v: f64| ((v / self.cell[1] - 0.5).ceil().max(0.0) as usize).min(self.rows());
        for (row, crossings) in
            crossings.iter_mut().enumerate().take(row_after(upper[1])).skip(row_after(lower[1]))
        {
            let v = (row as f64 + 0.5) * self.cell[1];
            let share = (v - lower[1]) / (upper[1] - lower[1]);
            crossings.push(lower[0] + share * (upper[0] - lower[0]));
        }
    }
}

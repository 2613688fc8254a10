use dymlm_core::vector3::{difference, dot};

use crate::linear_algebra::plane_axes;
use crate::patch::Patch;

/// A plane's coordinate frame: an origin on the plane and two axes in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaneFrame {
    pub(crate) origin: [f64; 3],
    pub(crate) axes: [[f64; 3]; 2],
}

impl PlaneFrame {
    pub(crate) fn new(origin: [f64; 3], normal: [f64; 3]) -> Self {
        Self { origin, axes: plane_axes(normal) }
    }

    /// Coordinates of a point's foot on the plane, metres.
    #[inline]
    pub(crate) fn to_plane(self, point: [f64; 3]) -> [f64; 2] {
        let offset = difference(point, self.origin);
        self.axes.map(|axis| dot(axis, offset))
    }

    /// The point of the plane at given coordinates.
    pub(crate) fn to_world(self, [u, v]: [f64; 2]) -> [f64; 3] {
        let [a, b] = self.axes;
        std::array::from_fn(|axis| self.origin[axis] + u * a[axis] + v * b[axis])
    }
}

/// Cells along both axes of a plane, half-open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CellRange {
    pub(crate) min: [i64; 2],
    pub(crate) max: [i64; 2],
}

impl CellRange {
    /// The smallest range that holds all cells; `None` of no cells.
    pub(crate) fn of(cells: impl Iterator<Item = [i64; 2]>) -> Option<Self> {
        cells.fold(None, |range: Option<Self>, cell| {
            let mut range = range.unwrap_or(Self { min: cell, max: cell.map(|c| c + 1) });
            for (axis, c) in cell.into_iter().enumerate() {
                range.min[axis] = range.min[axis].min(c);
                range.max[axis] = range.max[axis].max(c + 1);
            }
            Some(range)
        })
    }

    pub(crate) fn grown(&self, cells: i64) -> Self {
        Self { min: self.min.map(|c| c - cells), max: self.max.map(|c| c + cells) }
    }

    pub(crate) fn intersection(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].max(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].min(other.max[axis])),
        }
    }

    pub(crate) fn size(&self) -> [usize; 2] {
        std::array::from_fn(|axis| (self.max[axis] - self.min[axis]).max(0) as usize)
    }
}

/// Which square cells of a plane hold inliers: a finite plane as a picture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PlaneGrid {
    pub(crate) frame: PlaneFrame,
    pub(crate) cell_size: f64,
    pub(crate) range: CellRange,
    occupied: Vec<bool>,
}

/// The cells of a patch's voxels, in the order of the voxels.
pub(crate) fn cells_of(patch: &Patch, voxel_size: f64, frame: &PlaneFrame) -> impl Iterator<Item = [i64; 2]> {
    let scale = 1.0 / voxel_size;
    patch
        .voxels()
        .iter()
        .map(move |voxel| frame.to_plane(voxel.center(voxel_size)).map(|x| (x * scale).floor() as i64))
}

/// A single map plane of more cells is none that was ever seen.
const MOST_CELLS: usize = 1 << 27;

/// A cell is filled from this share of the mean weight around it on: half of what is inside an edge, when a
/// third of the cells around hold nothing.
const FILLED_SHARE: f64 = 0.6;

impl PlaneGrid {
    /// The cells that voxels fall into, as large as voxels; only those within `window`. `None` without any.
    pub(crate) fn touched_by(
        patch: &Patch,
        voxel_size: f64,
        frame: PlaneFrame,
        window: CellRange,
    ) -> Option<Self> {
        let range = CellRange::of(cells_of(patch, voxel_size, &frame))?.intersection(&window);
        let mut grid = Self::empty(frame, voxel_size, range)?;
        for cell in cells_of(patch, voxel_size, &frame) {
            if let Some(index) = grid.index(cell) {
                grid.occupied[index] = true;
            }
        }
        Some(grid)
    }

    /// The cells that are at least half full. A cell that the rim passes through holds fewer samples than
    /// those inside, so the number of samples, shared out to the four cells nearest to each voxel, tells how
    /// full it is.
    pub(crate) fn filled_by(patch: &Patch, voxel_size: f64, frame: PlaneFrame) -> Option<Self> {
        let range = CellRange::of(cells_of(patch, voxel_size, &frame))?.grown(1);
        let mut grid = Self::empty(frame, voxel_size, range)?;
        let weights = grid.share_out(patch);
        let sums = grid.sums_from_corner(&weights);
        for v in 0..grid.height() {
            for u in 0..grid.width() {
                let index = v * grid.width() + u;
                let [weight, cells] = grid.sum_around(&sums, u, v);
                grid.occupied[index] =
                    weights[index] > 0.0 && weights[index] * cells >= FILLED_SHARE * weight;
            }
        }
        Some(grid)
    }

    fn empty(frame: PlaneFrame, cell_size: f64, range: CellRange) -> Option<Self> {
        let [width, height] = range.size();
        let cells = width.saturating_mul(height);
        let allowed = (1..=MOST_CELLS).contains(&cells);
        allowed.then(|| Self { frame, cell_size, range, occupied: vec![false; cells] })
    }

    /// Each voxel's samples, shared by the four cells around its centre.
    fn share_out(&self, patch: &Patch) -> Vec<f64> {
        let mut weights = vec![0.0; self.occupied.len()];
        for voxel in patch.voxels() {
            let at = self.frame.to_plane(voxel.center(self.cell_size)).map(|x| x / self.cell_size - 0.5);
            let first = at.map(f64::floor);
            let part = [at[0] - first[0], at[1] - first[1]];
            let count = f64::from(voxel.count());
            for (du, of_u) in [(0, 1.0 - part[0]), (1, part[0])] {
                for (dv, of_v) in [(0, 1.0 - part[1]), (1, part[1])] {
                    if let Some(index) = self.index([first[0] as i64 + du, first[1] as i64 + dv]) {
                        weights[index] += count * of_u * of_v;
                    }
                }
            }
        }
        weights
    }

    /// Sums of weights, and numbers of cells that have one, over the rectangles from the first corner.
    fn sums_from_corner(&self, weights: &[f64]) -> Vec<[f64; 2]> {
        let (width, height) = (self.width(), self.height());
        let mut sums = vec![[0.0; 2]; (width + 1) * (height + 1)];
        for v in 0..height {
            let mut row = [0.0; 2];
            for u in 0..width {
                let weight = weights[v * width + u];
                row[0] += weight;
                row[1] += if weight > 0.0 { 1.0 } else { 0.0 };
                let above = sums[v * (width + 1) + u + 1];
                sums[(v + 1) * (width + 1) + u + 1] = [above[0] + row[0], above[1] + row[1]];
            }
        }
        sums
    }

    /// The same over the 5x5 cells around one.
    fn sum_around(&self, sums: &[[f64; 2]], u: usize, v: usize) -> [f64; 2] {
        let stride = self.width() + 1;
        let (u0, v0) = (u.saturating_sub(2), v.saturating_sub(2));
        let (u1, v1) = ((u + 3).min(self.width()), (v + 3).min(self.height()));
        let at = |u: usize, v: usize| sums[v * stride + u];
        std::array::from_fn(|k| at(u1, v1)[k] - at(u0, v1)[k] - at(u1, v0)[k] + at(u0, v0)[k])
    }

    pub(crate) fn width(&self) -> usize {
        self.range.size()[0]
    }

    pub(crate) fn height(&self) -> usize {
        self.range.size()[1]
    }

    /// Row by row along the second axis.
    pub(crate) fn occupied(&self) -> &[bool] {
        &self.occupied
    }

    fn index(&self, [u, v]: [i64; 2]) -> Option<usize> {
        let [u, v] = [u - self.range.min[0], v - self.range.min[1]];
        let inside = u >= 0 && v >= 0 && (u as usize) < self.width() && (v as usize) < self.height();
        inside.then(|| v as usize * self.width() + u as usize)
    }

    pub(crate) fn is_occupied(&self, cell: [i64; 2]) -> bool {
        self.index(cell).is_some_and(|index| self.occupied[index])
    }

    /// Whether an occupied cell's square lies within `distance` metres of a cell's square.
    pub(crate) fn is_near(&self, [u, v]: [i64; 2], distance: f64) -> bool {
        let reach = (distance / self.cell_size).floor() as i64 + 1;
        let between = |a: i64| (a.abs() - 1).max(0) as f64 * self.cell_size;
        (-reach..=reach).any(|dv| {
            (-reach..=reach)
                .any(|du| between(du).hypot(between(dv)) <= distance && self.is_occupied([u + du, v + dv]))
        })
    }
}

/// Patches adjoin with this many voxels, 20 cm of a rim at 2.5 cm, ...
const MOST_CONTACT: usize = 8;
/// ... small ones with one out of so many. In a long recording a few voxels stray from any patch, over the
/// gap between two screens for one.
const CONTACT_SHARE: usize = 10;

/// Whether two patches overlap on a plane, or no more than `max_gap` metres (to a voxel) lie between them:
/// where enough voxels of the one are as near to the other.
///
/// O(voxels) when they overlap or are far apart.
pub(crate) fn patches_adjoin(
    a: &Patch,
    b: &Patch,
    voxel_size: f64,
    frame: &PlaneFrame,
    max_gap: f64,
) -> bool {
    let smaller = a.voxels().len().min(b.voxels().len());
    let contact = MOST_CONTACT.min(smaller.div_ceil(CONTACT_SHARE));
    if contact > 0 && a.common_voxels(b, contact) == contact {
        return true;
    }
    let Some(range) = CellRange::of(cells_of(a, voxel_size, frame)) else { return false };
    let window = range.grown((max_gap / voxel_size).ceil() as i64 + 1);
    let Some(grid) = PlaneGrid::touched_by(b, voxel_size, *frame, window) else { return false };
    cells_of(a, voxel_size, frame).filter(|&cell| grid.is_near(cell, max_gap)).take(contact).count()
        == contact
}

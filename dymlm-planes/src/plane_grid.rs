use crate::linear_algebra::{dot, plane_axes, subtract};
use crate::plane_map::Patch;

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
        let offset = subtract(point, self.origin);
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

impl PlaneGrid {
    /// The cells of a patch, as large as its voxels; only those within `window` if one is given. `None` without any.
    pub(crate) fn of_patch(
        patch: &Patch,
        voxel_size: f64,
        frame: PlaneFrame,
        window: Option<CellRange>,
    ) -> Option<Self> {
        let mut range = CellRange::of(cells_of(patch, voxel_size, &frame))?;
        if let Some(window) = window {
            range = range.intersection(&window);
        }
        let [width, height] = range.size();
        // A single map plane of more than 2^27 cells is none that was ever seen.
        if width == 0 || height == 0 || width.saturating_mul(height) > 1 << 27 {
            return None;
        }
        let mut grid = Self { frame, cell_size: voxel_size, range, occupied: vec![false; width * height] };
        for cell in cells_of(patch, voxel_size, &frame) {
            if let Some(index) = grid.index(cell) {
                grid.occupied[index] = true;
            }
        }
        Some(grid)
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

/// Whether two patches overlap on a plane, or no more than `max_gap` metres (to a voxel) lie between them.
///
/// O(voxels) when they overlap or are far apart.
pub(crate) fn patches_adjoin(
    a: &Patch,
    b: &Patch,
    voxel_size: f64,
    frame: &PlaneFrame,
    max_gap: f64,
) -> bool {
    if a.overlaps(b) {
        return true;
    }
    let Some(range) = CellRange::of(cells_of(a, voxel_size, frame)) else { return false };
    let window = range.grown((max_gap / voxel_size).ceil() as i64 + 1);
    let Some(grid) = PlaneGrid::of_patch(b, voxel_size, *frame, Some(window)) else { return false };
    cells_of(a, voxel_size, frame).any(|cell| grid.is_near(cell, max_gap))
}

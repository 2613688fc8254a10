use parry3d::math::{Mat3, Vec3};

use crate::scene::Part;

/// A block of cubic cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CellGrid {
    corner: Vec3,
    size: f32,
    counts: [usize; 3],
}

/// Axis-aligned bounds of a body in the scene: centre and half extents.
pub(super) fn bounds(part: &Part) -> [Vec3; 2] {
    let rotation = Mat3::from_quat(part.scene_from_part.rotation);
    let half = part.shape.half_extents();
    let reach =
        rotation.x_axis.abs() * half.x + rotation.y_axis.abs() * half.y + rotation.z_axis.abs() * half.z;
    [part.scene_from_part.translation, reach]
}

impl CellGrid {
    /// A grid without cells.
    pub(super) const EMPTY: Self = Self { corner: Vec3::ZERO, size: 1.0, counts: [0; 3] };

    /// A grid of cells of side `size` over all bodies and `margin` around them.
    pub(super) fn around(parts: &[Part], margin: f32, size: f32) -> Self {
        let mut low = Vec3::INFINITY;
        let mut high = Vec3::NEG_INFINITY;
        for [center, half] in parts.iter().map(bounds) {
            low = low.min(center - half);
            high = high.max(center + half);
        }
        if !(low.is_finite() && high.is_finite()) {
            return Self::EMPTY;
        }
        let corner = low - margin;
        let counts = ((high + margin - corner) / size).ceil().to_array().map(|count| count as usize);
        Self { corner, size, counts }
    }

    /// The smallest grid that holds two grids with the same cell size and arbitrary corners.
    pub(super) fn joined(self, other: Self) -> Self {
        if self.len() == 0 {
            return other;
        }
        if other.len() == 0 {
            return self;
        }
        let far = |grid: &Self| grid.corner + Vec3::from(grid.counts.map(|count| count as f32)) * grid.size;
        let corner = self.corner.min(other.corner);
        let counts =
            ((far(&self).max(far(&other)) - corner) / self.size).ceil().to_array().map(|n| n as usize);
        Self { corner, size: self.size, counts }
    }

    /// Number of cells.
    pub(super) fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// The grid of cells with `factor` times the side that has the same lowest corner and holds this one.
    pub(super) fn coarser(self, factor: usize) -> Self {
        let counts = self.counts.map(|count| count.div_ceil(factor));
        Self { size: self.size * factor as f32, counts, ..self }
    }

    /// The cell that holds a point.
    pub(super) fn cell(&self, point: Vec3) -> Option<usize> {
        self.place(point).map(|place| self.index(place))
    }

    /// Where the cell that holds a point is along each axis.
    pub(super) fn place(&self, point: Vec3) -> Option<[usize; 3]> {
        let place = ((point - self.corner) / self.size).floor().to_array();
        let inside = |axis: usize| place[axis] >= 0.0 && place[axis] < self.counts[axis] as f32;
        (inside(0) && inside(1) && inside(2)).then(|| place.map(|c| c as usize))
    }

    /// Where a cell is along each axis.
    pub(super) fn place_of(&self, cell: usize) -> [usize; 3] {
        let [_, ny, nz] = self.counts;
        [cell / (ny * nz), cell / nz % ny, cell % nz]
    }

    /// The middle of a cell.
    pub(super) fn center(&self, cell: usize) -> Vec3 {
        self.center_of(self.place_of(cell))
    }

    /// The middle of the cell at a place.
    pub(super) fn center_of(&self, place: [usize; 3]) -> Vec3 {
        self.corner + (Vec3::from(place.map(|c| c as f32)) + 0.5) * self.size
    }

    /// The cells within `half` of `center` along each axis.
    pub(super) fn cells_within(&self, [center, half]: [Vec3; 2]) -> impl Iterator<Item = usize> + use<> {
        let grid = *self;
        let low = ((center - half - self.corner) / self.size).floor().max(Vec3::ZERO).to_array();
        let high = ((center + half - self.corner) / self.size).floor().to_array();
        let range =
            |axis: usize| low[axis] as usize..((high[axis] + 1.0).max(0.0) as usize).min(grid.counts[axis]);
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        xs.flat_map(move |x| {
            let zs = zs.clone();
            ys.clone().flat_map(move |y| zs.clone().map(move |z| grid.index([x, y, z])))
        })
    }

    /// The cell at a place.
    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.counts[1] + y) * self.counts[2] + z
    }
}

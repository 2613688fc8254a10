use dymlm_core::{PlaneId, Pose};
use dymlm_octree::GridRegion;
use dymlm_planes::MapPlane;

/// Side of the cells in which planes are held against each other, metres. Planes join over a gap of one.
/// Smaller parts a floor at what lies on it; larger joins what lies beyond a wall.
const CELL: f64 = 0.25;
/// Number of cells in which planes must meet: one may be a stray reading.
const CONTACT_CELLS: usize = 2;

/// A plane that may be a part of a floor, in the axes of a grid.
#[derive(Debug, Clone)]
pub(super) struct FloorPlane {
    pub(super) id: PlaneId,
    /// Square metres.
    pub(super) area: f64,
    slope: [f64; 2],
    offset: f64,
    cells: Raster,
}

/// Which cells of a rectangle hold inliers.
#[derive(Debug, Clone)]
struct Raster {
    first: [i64; 2],
    size: [usize; 2],
    filled: Vec<bool>,
}

impl FloorPlane {
    /// `None` for a plane without inliers, or that is not level enough to have heights.
    pub(super) fn of(plane: &MapPlane, voxel_size: f64, grid_from_world: &Pose) -> Option<Self> {
        let [x, y, up] = grid_from_world.rotate(plane.plane().normal());
        let places: Vec<[f64; 2]> =
            plane.inlier_points().map(|point| place(grid_from_world, point)).collect();
        let cells = Raster::of(&places)?;
        (up > 0.1).then(|| Self {
            id: plane.id(),
            area: plane.inlier_voxels() as f64 * voxel_size * voxel_size,
            slope: [-x / up, -y / up],
            offset: -plane.plane().d() / up,
            cells,
        })
    }

    /// Its height at a place in the grid's axes, metres.
    pub(super) fn height(&self, [x, y]: [f64; 2]) -> f64 {
        self.slope[0] * x + self.slope[1] * y + self.offset
    }

    /// Its lowest and highest, metres.
    pub(super) fn heights(&self) -> [f64; 2] {
        let heights = self.cells.centers().map(|center| self.height(center));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], own| [low.min(own), high.max(own)])
    }

    pub(super) fn region(&self) -> GridRegion {
        let Raster { first, size, .. } = &self.cells;
        let corner = |axis: usize, cells: usize| (first[axis] + cells as i64) as f64 * CELL;
        GridRegion { min: [corner(0, 0), corner(1, 0)], max: [corner(0, size[0]), corner(1, size[1])] }
    }

    pub(super) fn cell_count(&self) -> usize {
        self.cells.centers().count()
    }

    /// Whether one goes on to the other: they come near each other, and there by no more than a step.
    pub(super) fn joins(&self, other: &Self, max_step: f64) -> bool {
        let (small, large) =
            if self.cells.filled.len() <= other.cells.filled.len() { (self, other) } else { (other, self) };
        let is_contact = |center: &[f64; 2]| {
            (self.height(*center) - other.height(*center)).abs() <= max_step
                && large.cells.is_near(*center, 1)
        };
        small.cells.centers().filter(is_contact).take(CONTACT_CELLS).count() == CONTACT_CELLS
    }

    /// In how many of its cells it is above another plane, no farther than that many metres up, or beside by no
    /// more than `beside` cells.
    pub(super) fn cells_over(&self, lower: &Self, most: f64, beside: i64) -> usize {
        let is_over = |center: &[f64; 2]| {
            (0.0..most).contains(&(self.height(*center) - lower.height(*center)))
                && lower.cells.is_near(*center, beside)
        };
        self.cells.centers().filter(is_over).count()
    }
}

/// Where a point is in the grid's axes, its height left out.
pub(super) fn place(grid_from_world: &Pose, point: [f32; 3]) -> [f64; 2] {
    let [x, y, _] = grid_from_world.transform_point(point.map(f64::from));
    [x, y]
}

impl Raster {
    fn of(places: &[[f64; 2]]) -> Option<Self> {
        let cell = |place: &[f64; 2]| place.map(|c| (c / CELL).floor() as i64);
        let mut first = cell(places.first()?);
        let mut last = first;
        for own in places.iter().map(cell) {
            for axis in 0..2 {
                (first[axis], last[axis]) = (first[axis].min(own[axis]), last[axis].max(own[axis]));
            }
        }
        let size = [0, 1].map(|axis| (last[axis] - first[axis] + 1) as usize);
        let mut raster = Self { first, size, filled: vec![false; size[0].checked_mul(size[1])?] };
        for own in places.iter().map(cell) {
            if let Some(filled) = raster.index(own).and_then(|index| raster.filled.get_mut(index)) {
                *filled = true;
            }
        }
        Some(raster)
    }

    fn index(&self, cell: [i64; 2]) -> Option<usize> {
        let [x, y] = [0, 1].map(|axis| usize::try_from(cell[axis] - self.first[axis]).ok());
        let (x, y) = (x.filter(|&x| x < self.size[0])?, y.filter(|&y| y < self.size[1])?);
        Some(y * self.size[0] + x)
    }

    fn centers(&self) -> impl Iterator<Item = [f64; 2]> {
        let filled = self.filled.iter().enumerate().filter(|(_, filled)| **filled);
        filled.map(|(index, _)| {
            let cell = [index % self.size[0], index / self.size[0]];
            [0, 1].map(|axis| (self.first[axis] as f64 + cell[axis] as f64 + 0.5) * CELL)
        })
    }

    /// Whether a cell within so many of the one at a place is filled.
    fn is_near(&self, place: [f64; 2], cells: i64) -> bool {
        let [x, y] = place.map(|c| (c / CELL).floor() as i64);
        let filled = |cell| self.index(cell).and_then(|index| self.filled.get(index)).is_some_and(|&is| is);
        (y - cells..=y + cells).any(|y| (x - cells..=x + cells).any(|x| filled([x, y])))
    }
}

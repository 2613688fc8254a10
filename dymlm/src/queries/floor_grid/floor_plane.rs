use std::collections::BTreeMap;

use dymlm_core::{PlaneId, Pose};
use dymlm_octree::GridRegion;
use dymlm_planes::MapPlane;

/// Side of the cells in which planes are held against each other, metres. Planes join over a gap of one.
/// Smaller parts a floor at what lies on it; larger joins what lies beyond a wall.
const CELL: f64 = 0.25;
/// Number of cells in which planes must meet: one may be a stray reading.
const CONTACT_CELLS: usize = 2;

/// A plane that may be a part of a floor, in the axes of a grid.
///
/// Its heights are those at which it was read: a ramp that rises by little is one plane with the floor that it
/// begins on, and the plane that is fitted to both is centimetres off either.
#[derive(Debug, Clone)]
pub(super) struct FloorPlane {
    pub(super) id: PlaneId,
    /// Square metres.
    pub(super) area: f64,
    slope: [f64; 2],
    offset: f64,
    voxel_size: f64,
    cells: Raster,
}

/// The mean height at which a plane was read, in each cell where it was. A plane may reach for kilometres
/// and fill little of the rectangle around it.
#[derive(Debug, Clone)]
struct Raster {
    /// The lowest and the highest column and row.
    ends: [[i64; 2]; 2],
    heights: BTreeMap<[i64; 2], f64>,
}

impl FloorPlane {
    /// `None` for a plane without inliers, or that is not level enough to have heights.
    pub(super) fn of(plane: &MapPlane, voxel_size: f64, grid_from_world: &Pose) -> Option<Self> {
        let [x, y, up] = grid_from_world.rotate(plane.plane().normal());
        let read: Vec<[f64; 3]> =
            plane.voxel_centers().map(|center| grid_from_world.transform_point(center)).collect();
        let cells = Raster::of(&read)?;
        (up > 0.1).then(|| Self {
            id: plane.id(),
            area: plane.inlier_voxels() as f64 * voxel_size * voxel_size,
            slope: [-x / up, -y / up],
            offset: -plane.plane().d() / up,
            voxel_size,
            cells,
        })
    }

    /// The plane's height at a place in the grid's axes, metres.
    pub(super) fn height(&self, [x, y]: [f64; 2]) -> f64 {
        self.slope[0] * x + self.slope[1] * y + self.offset
    }

    /// Its height at a place where it was read at a mean height: that of the plane, unless the readings
    /// contradict it by more than a voxel.
    pub(super) fn height_read(&self, place: [f64; 2], read: f64) -> f64 {
        let fitted = self.height(place);
        if (fitted - read).abs() <= self.voxel_size { fitted } else { read }
    }

    /// Lowest and highest at which it was read, metres.
    pub(super) fn heights(&self) -> [f64; 2] {
        let heights = self.cells.filled().map(|(_, height)| height);
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], own| [low.min(own), high.max(own)])
    }

    pub(super) fn region(&self) -> GridRegion {
        let [min, max] = self.cells.ends;
        GridRegion { min: min.map(|c| c as f64 * CELL), max: max.map(|c| (c + 1) as f64 * CELL) }
    }

    pub(super) fn cell_count(&self) -> usize {
        self.cells.heights.len()
    }

    /// Whether one goes on to the other: they come near each other, and there by no more than a step.
    pub(super) fn joins(&self, other: &Self, max_step: f64) -> bool {
        let (small, large) =
            if self.cells.heights.len() <= other.cells.heights.len() { (self, other) } else { (other, self) };
        let is_contact = |&(cell, height): &([i64; 2], f64)| {
            large.cells.near(cell, 1).any(|(beside, other)| {
                // From the one cell to the other as the plane slopes.
                let way = [0, 1].map(|axis| (cell[axis] - beside[axis]) as f64 * CELL);
                let goes_on = other + large.slope[0] * way[0] + large.slope[1] * way[1];
                (height - goes_on).abs() <= max_step
            })
        };
        small.cells.filled().filter(is_contact).take(CONTACT_CELLS).count() == CONTACT_CELLS
    }

    /// In how many of its cells it is above another plane, no farther than that many metres up, or beside by no
    /// more than `beside` cells.
    pub(super) fn cells_over(&self, lower: &Self, most: f64, beside: i64) -> usize {
        let is_over = |&(cell, height): &([i64; 2], f64)| {
            lower.cells.near(cell, beside).any(|(_, other)| (0.0..most).contains(&(height - other)))
        };
        self.cells.filled().filter(is_over).count()
    }
}

impl Raster {
    fn of(read: &[[f64; 3]]) -> Option<Self> {
        let cell = |[x, y, _]: &[f64; 3]| [x, y].map(|c| (c / CELL).floor() as i64);
        let mut first = cell(read.first()?);
        let mut last = first;
        for own in read.iter().map(cell) {
            for axis in 0..2 {
                (first[axis], last[axis]) = (first[axis].min(own[axis]), last[axis].max(own[axis]));
            }
        }
        let mut sums = BTreeMap::new();
        for point in read {
            let (sum, count) = sums.entry(cell(point)).or_insert((0.0, 0_u32));
            *sum += point[2];
            *count += 1;
        }
        let heights = sums.into_iter().map(|(cell, (sum, count))| (cell, sum / f64::from(count))).collect();
        Some(Self { ends: [first, last], heights })
    }

    /// The cells in which the plane was read, and how high.
    fn filled(&self) -> impl Iterator<Item = ([i64; 2], f64)> {
        self.heights.iter().map(|(&cell, &height)| (cell, height))
    }

    /// Those within so many cells of one.
    fn near(&self, [x, y]: [i64; 2], cells: i64) -> impl Iterator<Item = ([i64; 2], f64)> {
        let around = (y - cells..=y + cells).flat_map(move |y| (x - cells..=x + cells).map(move |x| [x, y]));
        around.filter_map(|cell| Some((cell, *self.heights.get(&cell)?)))
    }
}

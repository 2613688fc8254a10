use dymlm_core::{PlaneId, Pose};
use dymlm_octree::GridRegion;
use dymlm_planes::PlaneMap;

use super::FloorGridConfig;
use super::floor_plane::FloorPlane;

/// What has a floor less than this far below it is furniture on that, if it reaches no farther than
/// [`BESIDE`] from where the floor was read. Metres: lower than a storey.
const STOREY: f64 = 1.8;
/// In cells of a quarter of a metre: half of a wide table. More takes the landings of stairs for furniture.
const BESIDE: i64 = 4;

/// The planes of the map that may be floors, in the order in which they came into it.
pub(super) fn floor_planes(
    planes: &PlaneMap,
    grid_from_world: &Pose,
    config: &FloorGridConfig,
    start: Option<PlaneId>,
) -> Vec<FloorPlane> {
    let least_cosine = config.max_slope_deg.to_radians().cos();
    let voxel_size = planes.config().voxel_size;
    let is_floor = |plane: &&dymlm_planes::MapPlane| {
        let [.., cosine] = grid_from_world.rotate(plane.plane().normal());
        let area = plane.inlier_voxels() as f64 * voxel_size * voxel_size;
        Some(plane.id()) == start || (cosine >= least_cosine && area >= config.min_plane_area)
    };
    let floors = planes.iter().filter(is_floor);
    floors.filter_map(|plane| FloorPlane::of(plane, voxel_size, grid_from_world)).collect()
}

/// Planes that go on to each other, by steps no higher than is allowed: one floor. The first is where it
/// began.
#[derive(Debug, Clone)]
pub(super) struct Floor(pub(super) Vec<FloorPlane>);

impl Floor {
    /// The floor that a plane is a part of; `None` when that is none of the planes.
    pub(super) fn from_plane(start: PlaneId, mut planes: Vec<FloorPlane>, max_step: f64) -> Option<Self> {
        let first = planes.iter().position(|plane| plane.id == start)?;
        Some(Self::grown(planes.remove(first), &mut planes, max_step))
    }

    /// All floors, the lowest first: what the planes make together, without what is too small and without
    /// furniture.
    pub(super) fn all(mut planes: Vec<FloorPlane>, config: &FloorGridConfig) -> Vec<Self> {
        // The largest plane begins each floor; of equal ones the older.
        planes.sort_by(|a, b| b.area.total_cmp(&a.area));
        let mut connected = Vec::new();
        while !planes.is_empty() {
            let start = planes.remove(0);
            connected.push(Self::grown(start, &mut planes, config.max_step));
        }
        connected.retain(|floor| floor.area() >= config.min_floor_area);
        connected.sort_by(|a, b| b.area().total_cmp(&a.area()));
        let mut floors: Vec<Self> = Vec::new();
        for floor in connected {
            if !floors.iter().any(|larger| floor.is_furniture_on(larger)) {
                floors.push(floor);
            }
        }
        floors.sort_by(|a, b| a.heights()[0].total_cmp(&b.heights()[0]));
        floors
    }

    /// A plane and all those of others that it goes on to, taken out of them.
    fn grown(start: FloorPlane, others: &mut Vec<FloorPlane>, max_step: f64) -> Self {
        let mut floor = vec![start];
        let mut next = 0;
        while let Some(plane) = floor.get(next) {
            let (joined, rest): (Vec<_>, _) =
                others.drain(..).partition(|other| plane.joins(other, max_step));
            *others = rest;
            floor.extend(joined);
            next += 1;
        }
        Self(floor)
    }

    fn area(&self) -> f64 {
        self.0.iter().map(|plane| plane.area).sum()
    }

    /// Lowest and highest, metres.
    pub(super) fn heights(&self) -> [f64; 2] {
        let all = self.0.iter().map(FloorPlane::heights);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], own| [low.min(own[0]), high.max(own[1])])
    }

    /// Around where it was read.
    pub(super) fn region(&self) -> Option<GridRegion> {
        self.0.iter().map(FloorPlane::region).reduce(|one, other| one.united(&other))
    }

    fn is_furniture_on(&self, larger: &Self) -> bool {
        let over = |plane: &FloorPlane| {
            larger.0.iter().map(|lower| plane.cells_over(lower, STOREY, BESIDE)).max().unwrap_or(0)
        };
        let cells: usize = self.0.iter().map(FloorPlane::cell_count).sum();
        2 * self.0.iter().map(over).sum::<usize>() > cells
    }
}

use dymlm_core::{PlaneId, Pose};
use dymlm_octree::{Extent, GridRegion, GridUpdate, OccupancyGrid, Octree};

use super::FloorGridConfig;
use super::floor::{Floor, floor_planes};
use super::floor_heights::FloorHeights;
use crate::{Error, MultiLevelMap};

/// The 2D map of one floor for a robot that drives on it: what is in the way between two heights above the
/// floor, as Nav2's map server reads it.
///
/// Made by [`MultiLevelMap::floor_grid`] and [`MultiLevelMap::floor_grids`]; [`update`](Self::update) brings it
/// up to date in place.
#[derive(Debug, Clone)]
pub struct FloorGrid {
    grid: OccupancyGrid,
    heights: FloorHeights,
    planes: Vec<PlaneId>,
    /// Where the floor was asked for.
    at: [f64; 3],
    up: [f64; 3],
    config: FloorGridConfig,
}

/// A floor, where its grid is, and how high it is there.
struct Laid {
    floor: Floor,
    region: GridRegion,
    heights: FloorHeights,
}

impl MultiLevelMap {
    /// The grid of the floor that is under a position (world, metres), seen along `up`.
    ///
    /// The floor is the plane under the position ([`floor_under`](Self::floor_under)) and all planes that it
    /// goes on to, level or sloping, by steps of no more than [`max_step`](FloorGridConfig::max_step): ramps,
    /// thresholds, landings. Heights count from the plane beneath each cell. Where none was read, the floor
    /// goes on as high as at the nearest place where it was.
    ///
    /// O(voxels of level planes, leaves, cells of the grid x leaves in a column): a room takes some
    /// milliseconds.
    ///
    /// # Errors
    ///
    /// [`Error::NoFloor`] where no floor is known under the position; [`Error::Config`]; [`Error::Octree`] for
    /// an `up` without length, and for a grid that is too large.
    ///
    /// ```
    /// use dymlm::{FloorGridConfig, MapBuilder, MapConfig};
    /// use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
    ///
    /// // A camera 1 m above a floor looks ahead along y; a wall is 3 m before it.
    /// let camera = PinholeCamera::new(160, 120, 100.0, 100.0, 79.5, 59.5)?;
    /// let row = |v: usize| if v > 84 { (100.0 / (v as f32 - 59.5)).min(3.0) } else { 3.0 };
    /// let depth = DepthImage::new(160, 120, (0..160 * 120).map(|i| row(i / 160)).collect())?;
    /// let rows = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
    /// let eye = Pose::from_rotation_matrix(rows, [0.0, 0.0, 1.0])?;
    /// let mut builder = MapBuilder::new(MapConfig::offline())?;
    /// for time in 0..4 {
    ///     builder.insert(&Frame::new(f64::from(time), camera, depth.clone(), None)?, &[], &eye)?;
    /// }
    ///
    /// let floor = builder.map().floor_grid([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], &FloorGridConfig::default())?;
    /// let grid = floor.grid();
    /// let state = |place: [f64; 2]| grid.cell_of(place).map(|[x, y]| grid.at(x, y));
    /// assert_eq!(state([0.0, 3.01]), Some(dymlm::octree::CellState::Occupied));
    /// assert_eq!(state([0.0, 2.5]), Some(dymlm::octree::CellState::Free));
    /// grid.inflated(0.3)?.save(std::env::temp_dir(), "map")?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn floor_grid(
        &self,
        at: [f64; 3],
        up: [f64; 3],
        config: &FloorGridConfig,
    ) -> Result<FloorGrid, Error> {
        config.validate()?;
        let grid_from_world = OccupancyGrid::frame(up)?.inverse();
        let start = self.start_of_floor(at, up, config)?;
        let floor = self.floor_from(start, &grid_from_world, config).ok_or(Error::NoFloor { at, up })?;
        FloorGrid::new(self, floor, at, up, config)
    }

    /// The grids of all floors, the lowest first: storeys, and what is parted by steps that are too high.
    /// Furniture is none: what is smaller than [`min_floor_area`](FloorGridConfig::min_floor_area), or has a
    /// floor beneath it or around it. Empty where no floor is known.
    ///
    /// # Errors
    ///
    /// As [`floor_grid`](Self::floor_grid), without [`Error::NoFloor`].
    pub fn floor_grids(&self, up: [f64; 3], config: &FloorGridConfig) -> Result<Vec<FloorGrid>, Error> {
        config.validate()?;
        let grid_from_world = OccupancyGrid::frame(up)?.inverse();
        let planes = floor_planes(&self.planes, &grid_from_world, config, None);
        let floors = Floor::all(planes, config).into_iter().map(|floor| {
            let start = floor.0.first().and_then(|plane| self.planes.plane(plane.id));
            let at = start.map_or([0.0; 3], dymlm_planes::MapPlane::centroid);
            FloorGrid::new(self, floor, at, up, config)
        });
        floors.collect()
    }

    /// The plane under a position, with which its floor begins.
    pub(crate) fn start_of_floor(
        &self,
        at: [f64; 3],
        up: [f64; 3],
        config: &FloorGridConfig,
    ) -> Result<PlaneId, Error> {
        // Of length 1, whatever the length of the caller's.
        let unit_up = OccupancyGrid::frame(up)?.rotate([0.0, 0.0, 1.0]);
        let under = self.floor_under(at, unit_up, config.max_distance, config.reach);
        under.map(|under| under.plane).ok_or(Error::NoFloor { at, up })
    }

    fn floor_from(&self, start: PlaneId, grid_from_world: &Pose, config: &FloorGridConfig) -> Option<Floor> {
        let planes = floor_planes(&self.planes, grid_from_world, config, Some(start));
        Floor::from_plane(start, planes, config.max_step)
    }

    /// A floor over the given region, else over all of it and `within`. Refused before room is made for the
    /// heights of its cells.
    fn lay(
        &self,
        floor: Floor,
        grid_from_world: &Pose,
        config: &FloorGridConfig,
        within: Option<GridRegion>,
    ) -> Result<Laid, Error> {
        let all = [floor.region(), within].into_iter().flatten().reduce(|one, other| one.united(&other));
        let nothing = GridRegion { min: [0.0; 2], max: [0.0; 2] };
        let region = config.region.or(all).unwrap_or(nothing);
        let resolution = self.octree.resolution();
        OccupancyGrid::check_size(&region, resolution)?;
        let heights =
            FloorHeights::of(&floor, &self.planes, grid_from_world, &region, resolution, config.max_step);
        Ok(Laid { floor, region, heights })
    }
}

/// Where something was observed between the heights above a floor, of what lies in cubes.
fn region_above(
    octree: &Octree,
    floor: &Floor,
    up: [f64; 3],
    config: &FloorGridConfig,
    cubes: &[Extent],
) -> Result<Option<GridRegion>, Error> {
    let [low, high] = floor.heights();
    Ok(octree.region_between(up, low + config.min_height, high + config.max_height, cubes)?)
}

impl FloorGrid {
    fn new(
        map: &MultiLevelMap,
        floor: Floor,
        at: [f64; 3],
        up: [f64; 3],
        config: &FloorGridConfig,
    ) -> Result<Self, Error> {
        let grid_from_world = OccupancyGrid::frame(up)?.inverse();
        let within = match (config.region, map.octree.extent()) {
            (None, Some(extent)) => region_above(&map.octree, &floor, up, config, &[extent])?,
            _ => None,
        };
        let laid = map.lay(floor, &grid_from_world, config, within)?;
        let above = |place| counted(&laid.heights, place, config);
        let grid = map.octree.project_between(up, &laid.region, above)?;
        let planes = laid.floor.0.iter().map(|plane| plane.id).collect();
        Ok(Self { grid, heights: laid.heights, planes, at, up, config: config.clone() })
    }

    /// Brings the grid up to date in place, from the state of the maps that it was made of to a newer one: what
    /// making it anew over the same region gives, to the cell. The floor is followed from the plane on that it
    /// began with, by whatever name. Without a region in the config the grid grows with what was observed, and
    /// never shrinks.
    ///
    /// O(voxels of level planes, cells of the grid) for the floor's heights, and what has changed: columns
    /// through cubes of the octree that differ, and over floor that is at another height now.
    ///
    /// # Errors
    ///
    /// As [`MultiLevelMap::floor_grid`]; the grid stays as it was.
    pub fn update(&mut self, earlier: &MultiLevelMap, now: &MultiLevelMap) -> Result<GridUpdate, Error> {
        let grid_from_world = self.grid.world_from_grid().inverse();
        let (at, up, config) = (self.at, self.up, &self.config);
        let known = self.planes.first().and_then(|start| now.planes.current_id(*start));
        let start =
            known.filter(|id| now.planes.plane(*id).is_some_and(dymlm_planes::MapPlane::is_confirmed));
        let start = start.map_or_else(|| now.start_of_floor(at, up, config), Ok)?;
        let floor = now.floor_from(start, &grid_from_world, config).ok_or(Error::NoFloor { at, up })?;

        let changes = now.octree.changes_since(&earlier.octree);
        let within = if config.region.is_some() {
            None
        } else {
            let new = region_above(&now.octree, &floor, up, config, &changes)?;
            Some(new.map_or(self.grid.region(), |new| new.united(&self.grid.region())))
        };
        let laid = now.lay(floor, &grid_from_world, config, within)?;
        let above = |place| counted(&laid.heights, place, config);
        let update = self.grid.update_between(&now.octree, &changes, Some(&laid.region), above)?;
        self.planes = laid.floor.0.iter().map(|plane| plane.id).collect();
        self.heights = laid.heights;
        Ok(update)
    }

    /// The grid.
    pub fn grid(&self) -> &OccupancyGrid {
        &self.grid
    }

    /// The planes that make the floor, the one with which it began first.
    pub fn planes(&self) -> &[PlaneId] {
        &self.planes
    }

    /// Height of the floor at a place in the grid's axes, along up from the world's origin, metres, to a tenth
    /// of a cell; `None` outside of the grid.
    pub fn floor_height(&self, place: [f64; 2]) -> Option<f64> {
        self.heights.at(place)
    }
}

/// What counts above a place of the floor: who stands beside a step up may stand on it as well.
fn counted(heights: &FloorHeights, place: [f64; 2], config: &FloorGridConfig) -> Option<[f64; 2]> {
    let on_step = heights.on_step(place)?;
    Some([on_step + config.min_height, on_step + config.max_height])
}

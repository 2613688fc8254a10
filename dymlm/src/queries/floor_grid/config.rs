use dymlm_core::{ConfigError, check_range};
use dymlm_octree::GridRegion;

/// How [`MultiLevelMap::floor_grid`](crate::MultiLevelMap::floor_grid) makes grids of floors. The defaults are
/// for a wheeled robot indoors.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct FloorGridConfig {
    /// What is lower above the floor is not in the way, metres; any number. Default 0.1: two of the octree's
    /// cells, since the noise of the floor's readings reaches into the one above it.
    pub min_height: f64,
    /// What is higher above the floor is not in the way, metres, more than `min_height`. Default 1.5.
    pub max_height: f64,
    /// Steepest floor, degrees from level, `0..=45`. Default 10: ramps for wheelchairs have 5.
    pub max_slope_deg: f64,
    /// Highest step over which a floor goes on, metres, `0..=1`. Default 0.05, what wheels get over: a higher
    /// step is an obstacle, and what is beyond it another floor.
    pub max_step: f64,
    /// Smallest plane that counts as a part of a floor, square metres, `0..=1e6`. Default 0.25.
    pub min_plane_area: f64,
    /// Smallest area at which planes make a floor of their own in
    /// [`floor_grids`](crate::MultiLevelMap::floor_grids), square metres, `0..=1e6`. Default 2: tables are
    /// smaller.
    pub min_floor_area: f64,
    /// How far above the floor the given position is at most, metres, `0..=100`. Default 3.
    pub max_distance: f64,
    /// How far from straight under the position the floor was read at least, metres, `0..=100`
    /// ([`floor_under`](crate::MultiLevelMap::floor_under)). Default 3: a forward camera does not see what it
    /// stands on.
    pub reach: f64,
    /// What the grid shows, in its own axes (see [`OccupancyGrid`](dymlm_octree::OccupancyGrid)). Default
    /// `None`: all of the floor, and all that was observed between the heights.
    pub region: Option<GridRegion>,
}

impl Default for FloorGridConfig {
    fn default() -> Self {
        Self {
            min_height: 0.1,
            max_height: 1.5,
            max_slope_deg: 10.0,
            max_step: 0.05,
            min_plane_area: 0.25,
            min_floor_area: 2.0,
            max_distance: 3.0,
            reach: 3.0,
            region: None,
        }
    }
}

impl FloorGridConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("floor_grid.min_height", self.min_height, -1e6..=1e6)?;
        check_range("floor_grid.max_height", self.max_height, self.min_height.next_up()..=1e6)?;
        check_range("floor_grid.max_slope_deg", self.max_slope_deg, 0.0..=45.0)?;
        check_range("floor_grid.max_step", self.max_step, 0.0..=1.0)?;
        check_range("floor_grid.min_plane_area", self.min_plane_area, 0.0..=1e6)?;
        check_range("floor_grid.min_floor_area", self.min_floor_area, 0.0..=1e6)?;
        check_range("floor_grid.max_distance", self.max_distance, 0.0..=100.0)?;
        check_range("floor_grid.reach", self.reach, 0.0..=100.0)
    }
}

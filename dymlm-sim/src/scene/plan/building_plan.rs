use std::fmt;
use std::sync::Arc;

use dymlm_core::check_range;

use super::raster::Raster;
use super::route::Route;
use super::solid::solid_cells;
use super::straightening::straighten;
use super::walls::{WallBox, wall_boxes};
use super::{PlanCell, PlanError, PlanGrid};

/// A building made from a floor plan: walls from the floor to the ceiling where the plan is occupied, straightened
/// within two cells, since the walls of recorded plans are rough.
///
/// All walls are along the plan's axes: a slanted one becomes steps of two cells and more. What walls enclose on all
/// sides is solid; specks of up to 2x2 cells are left out.
///
/// ```
/// use dymlm_sim::{BuildingPlan, PlanCell, PlanGrid, Sequence, SequenceConfig};
///
/// // A room of 4 x 3 m with walls of 0.1 m.
/// let (width, height) = (42, 32);
/// let is_wall = |x: usize, y: usize| x == 0 || y == 0 || x == width - 1 || y == height - 1;
/// let cells = (0..width * height)
///     .map(|k| if is_wall(k % width, k / width) { PlanCell::Occupied } else { PlanCell::Free });
/// let grid = PlanGrid { width, height, resolution: 0.1, origin: [0.0, 0.0], cells: cells.collect() };
/// let plan = BuildingPlan::new(&grid, 2.5)?;
/// let sequence = Sequence::new(&SequenceConfig::planned_building(plan, 7, 10.0, 600))?;
/// assert!(sequence.len() <= 600);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq)]
pub struct BuildingPlan(Arc<Plan>);

/// What is made of a floor plan.
#[derive(Debug, PartialEq)]
pub(super) struct Plan {
    pub(super) grid: PlanGrid,
    /// The free cells.
    pub(super) free: Raster,
    pub(super) walls: Vec<WallBox>,
    /// From the floor to the ceiling, metres.
    pub(super) wall_height: f32,
    pub(super) route: Route,
}

/// Free floor on all sides of the camera, metres: one can carry it through a door of 0.9 m.
const CLEARANCE: f32 = 0.4;

impl BuildingPlan {
    /// Largest number of cells.
    pub const MAX_CELLS: usize = 1 << 24;

    /// A building with walls `wall_height` metres high, 2..=20, on a floor plan with cells of 0.005 to 0.5 m and an
    /// area of up to 10000 square metres.
    ///
    /// # Errors
    ///
    /// [`PlanError`] when the grid is none, when nothing or everything is free, and when the camera has no way.
    pub fn new(grid: &PlanGrid, wall_height: f64) -> Result<Self, PlanError> {
        let (width, height) = (grid.width, grid.height);
        let count = width.checked_mul(height).filter(|count| (1..=Self::MAX_CELLS).contains(count));
        let count = count.ok_or(PlanError::Size { width, height })?;
        if grid.cells.len() != count {
            return Err(PlanError::CellCount { cells: grid.cells.len(), width, height });
        }
        check_range("resolution", grid.resolution, 0.005..=0.5)?;
        check_range("area", count as f64 * grid.resolution * grid.resolution, 0.0..=1e4)?;
        for coordinate in grid.origin {
            check_range("origin", coordinate, -1e4..=1e4)?;
        }
        check_range("height of walls", wall_height, 2.0..=20.0)?;

        let rough = solid_cells(grid)?;
        let solid = straighten(&rough);
        // What was solid and is not any more is floor.
        let cells = grid.cells.iter().zip(rough.cells.iter().zip(&solid.cells));
        let cells = cells.map(|(&cell, (&was_solid, &is_solid))| match (is_solid, cell) {
            (true, _) => PlanCell::Occupied,
            (false, PlanCell::Unknown) if !was_solid => PlanCell::Unknown,
            _ => PlanCell::Free,
        });
        let grid = PlanGrid { cells: cells.collect(), ..*grid };
        let free = Raster::of(&grid.cells, width, |&cell| cell == PlanCell::Free);
        let walls = wall_boxes(&grid, &solid);
        let route = Route::new(&grid, &free, CLEARANCE)?;
        Ok(Self(Arc::new(Plan { grid, free, walls, wall_height: wall_height as f32, route })))
    }

    /// The plan with straightened walls: what is occupied is solid from the floor to the ceiling.
    pub fn grid(&self) -> &PlanGrid {
        &self.0.grid
    }

    /// From the floor to the ceiling, metres.
    pub fn wall_height(&self) -> f64 {
        f64::from(self.0.wall_height)
    }

    /// Number of straight faces of walls.
    pub fn wall_count(&self) -> usize {
        self.0.walls.len()
    }

    /// Area over which a camera can be carried, square metres.
    pub fn open_area(&self) -> f64 {
        f64::from(self.0.route.area())
    }

    pub(super) fn plan(&self) -> &Plan {
        &self.0
    }
}

impl fmt::Debug for BuildingPlan {
    /// Without the cells.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PlanGrid { width, height, resolution, origin, .. } = &self.0.grid;
        formatter
            .debug_struct("BuildingPlan")
            .field("width", width)
            .field("height", height)
            .field("resolution", resolution)
            .field("origin", origin)
            .field("walls", &self.wall_count())
            .finish_non_exhaustive()
    }
}

//! The projection to a 2D grid: whole, of a region, updated where the octree has changed, inflated.

mod column;
mod files;
mod grid;
mod grid_axes;
mod inflation;
mod projection;
mod region;
mod update;

pub use grid::OccupancyGrid;
pub use region::GridRegion;
pub use update::GridUpdate;

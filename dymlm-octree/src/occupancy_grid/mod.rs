//! The projection to a 2D grid: whole, of a region, updated where the octree has changed, inflated; its files.

mod column;
mod files;
mod grid;
mod grid_axes;
mod inflation;
mod map_description;
mod map_file;
mod pgm;
mod projection;
mod region;
mod update;

pub use grid::OccupancyGrid;
pub use map_file::MapFile;
pub use region::GridRegion;
pub use update::GridUpdate;

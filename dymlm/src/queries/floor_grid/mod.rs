//! The 2D grid of a floor: what is in the way above it, at any height, on ramps and landings too.

mod config;
mod floor;
mod floor_heights;
mod floor_plane;
mod grid;

pub use config::FloorGridConfig;
pub use grid::FloorGrid;

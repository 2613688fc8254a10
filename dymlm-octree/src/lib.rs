//! Probabilistic occupancy octree with the model and the files of OctoMap.
//!
//! Use it when a robot needs to know which space is occupied, free, or unseen: it inserts scans and depth
//! frames, answers queries and ray casts, and reads and writes the `.bt` and `.ot` files of OctoMap and its
//! tools. The same scans give the same leaves as OctoMap, bit by bit, many times faster. It is no signed
//! distance field and holds no surface finer than its cells.
//!
//! - [`Octree`]: the map. Insertion: [`Octree::insert_scan`], [`Octree::insert_depth`],
//!   [`Octree::from_cloud`].
//! - Queries: [`Octree::state`], [`Octree::cast_ray`], [`Octree::nearest_obstacle`], [`Octree::leaves`],
//!   [`Octree::leaves_in_box`]; [`Octree::accessor`] for many queries in one neighbourhood.
//! - Files: [`Octree::read_ot`], [`Octree::write_ot`], [`Octree::read_bt`], [`Octree::write_bt`].
//! - [`OccupancyGrid`]: the projection to a 2D map as ROS navigation reads it: whole, of a region, updated
//!   where the octree has changed, inflated. [`MapFile`] reads such maps.
//!
//! World frame, metres; no axis is taken for up.

mod accessor;
mod body_motion;
mod cell_state;
mod changes;
mod config;
mod distance_field;
mod error;
mod files;
mod insertion;
mod lattice;
mod leaves;
mod nearest_obstacle;
mod occupancy_grid;
mod occupancy_model;
mod octree;
mod plain_conversion;
mod ray_cast;
#[cfg(feature = "state")]
mod saved_state;
mod storage;

pub use accessor::Accessor;
pub use body_motion::OctreeMotion;
pub use cell_state::CellState;
pub use config::{OctreeConfig, RayMode};
pub use distance_field::{Clearance, DistanceField};
pub use error::Error;
pub use insertion::InsertReport;
pub use leaves::{Leaf, Leaves};
pub use nearest_obstacle::NearestObstacle;
pub use occupancy_grid::{GridRegion, GridUpdate, MapFile, OccupancyGrid};
pub use octree::{Extent, Octree, OctreeCounts};
pub use ray_cast::{RayEnd, RayHit, UnknownCells};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

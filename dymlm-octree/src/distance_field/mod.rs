//! Distances to the nearest obstacle and their gradients, in a box.

mod cell_box;
mod field;
mod obstacles;
mod transform;

pub use field::{Clearance, DistanceField};
pub(crate) use transform::Transform;

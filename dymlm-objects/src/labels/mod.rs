//! What a label alone says of an object: its plausible size, and the shape that represents it.

mod coco_sizes;
mod shape_table;
mod size_prior;

pub use shape_table::{ShapeKind, ShapeTable};
pub use size_prior::{Footprint, SizePrior, SizePriors, SizeRange, UprightPose};

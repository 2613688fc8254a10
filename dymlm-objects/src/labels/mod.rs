//! What is known of an object from its label alone: how large such things are, and what shape stands for
//! them.

mod coco_sizes;
mod shape_table;
mod size_prior;

pub use shape_table::{ShapeKind, ShapeTable};
pub use size_prior::{Footprint, SizePrior, SizePriors, SizeRange, UprightPose};

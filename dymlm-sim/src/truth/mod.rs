//! The truth about a sequence, gathered from its scene and its frames.

mod cell_grid;
mod face_truth;
mod flat_side;
mod object_truth;
mod sequence_truth;
mod surface_samples;
mod surfaces;
mod swept_volume;
mod thin_parts;

pub(crate) use object_truth::box_around;
pub use sequence_truth::{Truth, TruthConfig};

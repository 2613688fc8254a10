//! The flat faces of the true world.

mod cell_raster;
mod face_truth;
mod flat_side;
mod rings;
mod true_face;

pub(super) use cell_raster::CellRaster;
pub(super) use face_truth::FaceTruth;
pub(super) use flat_side::{pose_of, to_pose};
pub use true_face::TrueFace;
pub(super) use true_face::raster_over;

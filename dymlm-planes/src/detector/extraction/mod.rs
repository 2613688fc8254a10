//! Planes of one depth image. See [`PlaneExtractor`].

mod bend;
mod block_grid;
mod block_moments;
mod cluster;
mod extractor;
mod growing;
mod meetings;
mod reached;
mod segment;
mod strip_profile;
mod tolerance;

pub(crate) use block_grid::SMALLEST_BLOCK;
pub(super) use extractor::PlaneExtractor;
pub(super) use segment::{Extraction, Segment};

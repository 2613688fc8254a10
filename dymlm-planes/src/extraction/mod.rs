//! Planes of one depth image. See [`PlaneExtractor`].

mod block_grid;
mod block_moments;
mod cluster;
mod config;
mod extractor;
mod growing;
mod meetings;
mod reached;
mod segment;
mod tolerance;

pub use config::ExtractionConfig;
pub use extractor::PlaneExtractor;
pub use segment::{Extraction, Segment};

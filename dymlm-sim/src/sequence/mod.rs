//! A recording that never was: frames by index, with their truth.

mod camera_path;
mod config;
mod sequence_type;
mod simulate;

pub use camera_path::CameraPath;
pub use config::SequenceConfig;
pub use sequence_type::SequenceType;
pub use simulate::{Sequence, SimulatedFrame, VisibleThing};

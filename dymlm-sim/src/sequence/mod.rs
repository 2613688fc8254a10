//! A simulated recording: frames by index, with their truth.

mod camera_path;
mod config;
mod frame_scratch;
mod frames;
mod pose_error;
mod pose_error_config;
mod recorded_drift;
mod sequence_type;
mod simulate;
mod simulated_frame;

pub use camera_path::CameraPath;
pub use config::SequenceConfig;
pub use frame_scratch::FrameScratch;
pub use frames::Frames;
pub use pose_error_config::PoseErrorConfig;
pub use recorded_drift::RecordedDrift;
pub use sequence_type::SequenceType;
pub use simulate::Sequence;
pub use simulated_frame::{CarriedThing, PlaceChange, SceneChange, SimulatedFrame, VisibleThing};

//! ROS 2 bags in MCAP (feature `mcap`): what is in a bag is listed in one pass, then frames are read one by one.

mod bag_file;
mod camera_info;
mod catalogue;
mod chunk;
mod detections;
mod options;
mod pictures;
mod recording;
mod topics;
mod transforms;

pub use options::McapOptions;
pub use recording::{McapFrame, McapRecording};
pub use transforms::NoTransform;

//! ROS 2 bags in MCAP (feature `mcap`): one pass lists the content of a bag, then frames are read one by one.

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

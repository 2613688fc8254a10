//! Sessions and maps for viewers, as ROS 2 bags in MCAP (feature `mcap`): `container` writes the file, the
//! other modules make messages of frames and maps. `bag` reads such files.

mod container;
mod frame_messages;
mod options;
mod pictures;
mod point_bytes;
mod record;
mod scene_entities;
mod writer;

pub use options::{ColorEncoding, DepthEncoding, McapWriterOptions};
pub use writer::{GridRecord, McapWriter};

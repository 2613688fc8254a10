//! TUM RGB-D datasets (Sturm 2012): folders of colour images, depth images, lists of both and a trajectory.

pub(crate) mod association;
mod camera_file;
mod dataset;
mod frame;
pub(crate) mod image_reader;
mod list_file;
mod lists;
mod options;
mod recording;
mod tum_camera;
mod writer;

pub use dataset::TumDataset;
pub use frame::{PosedFrame, TumFrame};
pub use image_reader::FrameBuffers;
pub use options::TumOptions;
pub use recording::{RecordedFrame, TumRecording};
pub use tum_camera::TumCamera;
pub use writer::TumWriter;

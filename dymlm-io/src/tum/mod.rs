//! TUM RGB-D datasets (Sturm 2012): a folder of colour images, depth images, lists of both and a trajectory.

mod association;
mod camera_file;
mod dataset;
mod list_file;
mod lists;
mod options;
mod writer;

pub use dataset::{FrameBuffers, PosedFrame, TumDataset, TumFrame};
pub use options::TumOptions;
pub use writer::TumWriter;

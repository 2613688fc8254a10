//! Reads TUM RGB-D datasets and detections, reads and writes PLY, PCD and map folders.
//!
//! Nothing that computes depends on this crate: it only converts between files and the types of
//! [`dymlm_core`].
//!
//! - [`TumDataset`], [`TumWriter`]: posed RGB-D sequences; [`Trajectory`]: poses over time, interpolated,
//!   never extrapolated.
//! - [`DetectionFile`] (JSON lines) and [`YoloFolder`]: a 2D detector's results for the frames.
//! - [`read_ply`], [`write_ply`], [`read_pcd`], [`write_pcd`]: point clouds.
//! - [`MapFolderWriter`], [`MapFolder`]: a folder of files with a manifest, written so that a crash never
//!   leaves it half-written; [`write_atomically`]: the same for one file.
//! - `McapRecording` (feature `mcap`): ROS 2 bags in MCAP as posed RGB-D frames with detections;
//!   `McapWriter`: sessions and their maps for viewers such as Foxglove and Rerun.
//! - `encode_glb` (feature `gltf`): a map as glTF.
//! - [`PlaneRecord`], [`ObjectRecord`]: `planes.json` and `objects.json`.
//! - [`write_png`], [`write_depth_png`] and their readers.
//!
//! Every [`Error`] names the file, and the line where one is known. Files are not trusted: no memory is
//! allocated for a count in a header before the bytes for it are there, and no input causes a panic.

#[cfg(feature = "mcap")]
mod bag;
mod detection_file;
mod error;
#[cfg(feature = "gltf")]
mod gltf;
mod image_file;
mod map_folder;
mod map_records;
#[cfg(feature = "mcap")]
mod mcap_writer;
mod pcd;
mod ply;
#[cfg(feature = "mcap")]
mod ros2;
mod scalar;
#[cfg(any(feature = "gltf", feature = "mcap"))]
mod shapes;
mod text_lines;
mod trajectory;
mod tum;
mod uncovered_time;
mod write_atomically;
mod yolo_folder;

#[cfg(feature = "mcap")]
pub use bag::{McapFrame, McapOptions, McapRecording, NoTransform};
pub use detection_file::{DetectionFile, encode_detections, write_detections};
pub use error::Error;
#[cfg(feature = "gltf")]
pub use gltf::encode_glb;
pub use image_file::{MAX_IMAGE_PIXELS, read_color_image, read_depth_png, write_depth_png, write_png};
pub use map_folder::{DamagedPart, MapFolder, MapFolderSaver, MapFolderWriter, StateParts, StateWriter};
pub use map_records::{
    ObjectRecord, PlaneRecord, ShapeRecord, encode_objects, encode_planes, id_color, read_objects,
    read_planes,
};
#[cfg(feature = "mcap")]
pub use mcap_writer::{ColorEncoding, DepthEncoding, GridRecord, McapWriter, McapWriterOptions};
pub use pcd::{PcdCloud, PcdField, decode_pcd, encode_pcd, read_pcd, write_pcd};
pub use ply::{PlyEncoder, decode_ply, encode_ply, read_ply, write_ply};
#[cfg(feature = "mcap")]
pub use shapes::outline_cloud;
pub use trajectory::{StampedPose, Trajectory, TrajectoryGap};
pub use tum::{
    FrameBuffers, PosedFrame, RecordedFrame, TumCamera, TumDataset, TumFrame, TumOptions, TumRecording,
    TumWriter,
};
pub use uncovered_time::UncoveredTime;
pub use write_atomically::write_atomically;
pub use yolo_folder::{YoloFolder, read_class_names};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

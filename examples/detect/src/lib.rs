//! YOLOX (Ge et al. 2021, arXiv:2107.08430) in Rust, by `tract`: detections in colour images without Python,
//! GPU or C libraries.
//!
//! - [`Yolox`]: a network and its detections in an image.
//! - [`ImageSource`]: the colour images of a recording.
//! - [`Comparison`]: how much two detectors' results differ.
//! - [`draw_boxes`]: a picture of the detections.
//!
//! The steps are those of YOLOX's own demonstration: the image is scaled by [`OpenCV`'s bilinear
//! interpolation](resize_bilinear) into the network's square, the rows of the output are decoded, and of
//! overlapping boxes of one class, the one with the higher score is kept.

mod bilinear;
mod class_names;
mod comparison;
mod drawing;
mod error;
mod image_source;
mod network;
mod network_input;
mod output_grid;
mod suppression;
mod yolox;
mod yolox_config;

pub use bilinear::resize_bilinear;
pub use class_names::COCO_NAMES;
pub use comparison::Comparison;
pub use drawing::draw_boxes;
pub use error::Error;
pub use image_source::ImageSource;
pub use yolox::Yolox;
pub use yolox_config::YoloxConfig;

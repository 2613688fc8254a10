//! Follows a moved object through images.
mod error;
mod flow;
mod gray_image;
mod kcf;

pub use error::Error;
pub use flow::{
    Corner, CornerConfig, CornerDetector, FlowConfig, FlowPoint, FlowStatus, ImagePyramid, Lighting,
    OpticalFlow,
};
pub use gray_image::GrayImage;
pub use kcf::{KcfConfig, KcfFeatures, KcfTracker, KcfUpdate, Learning};

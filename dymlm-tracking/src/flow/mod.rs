//! Motion of points in the image: pyramids, corners, pyramidal Lucas-Kanade.

mod config;
mod corners;
mod gradient_sums;
mod image_pyramid;
mod optical_flow;
mod sampling;
mod shifted_sums;
mod template;

pub use config::{FlowConfig, Lighting};
pub use corners::{Corner, CornerConfig, CornerDetector};
pub use image_pyramid::ImagePyramid;
pub use optical_flow::{FlowPoint, FlowStatus, OpticalFlow};
pub(crate) use template::{AlignmentLimits, Template};

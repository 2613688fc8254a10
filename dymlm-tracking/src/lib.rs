//! Follows a moved object through images.
mod error;
mod gray_image;
mod kcf;

pub use error::Error;
pub use gray_image::GrayImage;
pub use kcf::{KcfConfig, KcfFeatures, KcfTracker, KcfUpdate, Learning};

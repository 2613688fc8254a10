#![doc = include_str!("../README.md")]
//! # Parts
//!
//! Each part is useful alone:
//!
//! - [`KcfTracker`]: where a window of the image has gone (kernelized correlation filter);
//! - [`OpticalFlow`], [`CornerDetector`], [`ImagePyramid`]: where points have gone (pyramidal Lucas-Kanade);
//! - [`p3p`], [`PoseRansac`], [`PoseRefiner`]: poses from points in space, from pixels, or both;
//! - [`ObjectTracker`]: all of it, with states for what is occluded, lost, found again and at rest.
//!
//! Images are grey, f32, 0..=1 ([`GrayImage`]). The same input gives the same bits, on any machine that
//! computes f32 and f64 as IEEE 754 says.

mod error;
mod flow;
mod gray_image;
mod kcf;
mod object;
mod parabola;
mod pose;

pub use error::Error;
pub use flow::{
    Corner, CornerConfig, CornerDetector, FlowConfig, FlowPoint, FlowStatus, ImagePyramid, Lighting,
    OpticalFlow,
};
pub use gray_image::GrayImage;
pub use kcf::{KcfConfig, KcfTracker, KcfUpdate};
pub use object::{
    ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig, ObjectUpdate, RestReport, SurfacePoint,
};
pub use pose::{
    PoseConsensus, PoseObservation, PoseRansac, PoseRefiner, RansacConfig, RefinedPose, RobustKernel, p3p,
};

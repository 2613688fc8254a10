#![doc = include_str!("../README.md")]
//! # Parts
//!
//! Each part is useful alone:
//!
//! - [`KcfTracker`]: tracks a window of the image (kernelized correlation filter);
//! - [`OpticalFlow`], [`CornerDetector`], [`ImagePyramid`]: track points (pyramidal Lucas-Kanade);
//! - [`p3p`], [`PoseRansac`], [`PoseRefiner`]: poses from 3D points, from pixels, or from both;
//! - [`ObjectTracker`]: all of these, with states for occluded, lost, found again and at rest.
//!
//! Images are grey, f32, 0..=1 ([`GrayImage`]). The same input gives the same bits in each run of a program on a
//! machine. (Other machines may have another library of mathematics, whose `exp` and `acos` differ.)

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

//! Follows a chosen object that is moved by hand: its pose in six degrees of freedom, from colour and, where there is
//! any, depth.
//!
//! Each part is useful alone:
//!
//! - [`KcfTracker`]: where a window of the image has gone (kernelized correlation filter);
//! - [`OpticalFlow`], [`CornerDetector`], [`ImagePyramid`]: where points have gone (pyramidal Lucas-Kanade);
//! - [`rigid_alignment`], [`p3p`], [`PoseRansac`], [`PoseRefiner`]: poses from points in space, from pixels, or both;
//! - [`ObjectTracker`]: all of it, with states for what is hidden, lost, found again and at rest.
//!
//! Images are grey, f32, 0..=1 ([`GrayImage`]). The same input gives the same bits, on any machine that computes f32
//! and f64 as IEEE 754 says.
//!
//! ```
//! use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, SensorModel};
//! use dymlm_tracking::{ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig};
//!
//! // A speckled board of 40 x 30 cm, a metre before the camera, moved to the right.
//! let camera = PinholeCamera::new(320, 240, 260.0, 260.0, 159.5, 119.5)?;
//! let view = |time: f64, x: f64| -> Result<Frame, Box<dyn std::error::Error>> {
//!     let (mut color, mut depth) = (Vec::new(), Vec::new());
//!     for (u, v) in (0..240).flat_map(|v| (0..320).map(move |u| (u, v))) {
//!         let [s, t, _] = camera.back_project([f64::from(u), f64::from(v)], 1.0);
//!         let (s, t) = (s - x, t);
//!         let is_board = s.abs() < 0.2 && t.abs() < 0.15;
//!         let gray = 120.0 + 50.0 * (90.0 * s + 31.0 * t).sin() + 50.0 * (70.0 * t - 40.0 * s * t).cos();
//!         color.push(if is_board { [gray as u8; 3] } else { [40; 3] });
//!         depth.push(if is_board { 1.0 } else { 3.0 });
//!     }
//!     let (depth, color) = (DepthImage::new(320, 240, depth)?, ColorImage::new(320, 240, color)?);
//!     Ok(Frame::new(time, camera, depth, Some(color))?)
//! };
//! let at = |x: f64| Pose::new([x, 0.0, 1.01], [0.0, 0.0, 0.0, 1.0]);
//!
//! let board = ObjectModel::cuboid([0.4, 0.3, 0.02])?;
//! let world_from_camera = Pose::identity();
//! let (sensor, config) = (SensorModel::kinect(), ObjectTrackerConfig::default());
//! let first = view(0.0, 0.0)?;
//! let mut tracker =
//!     ObjectTracker::new(&first, &world_from_camera, board, None, &at(0.0)?, sensor, &config)?;
//! for (time, x) in [(0.1, 0.04), (0.2, 0.08), (0.3, 0.12)] {
//!     let update = tracker.track(&view(time, x)?, &[], &world_from_camera)?;
//!     assert_eq!(update.state, ObjectState::Tracking);
//!     assert!(update.world_from_object.distance(&at(x)?) < 0.002);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
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
pub use kcf::{KcfConfig, KcfFeatures, KcfTracker, KcfUpdate, Learning};
pub use object::{
    ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig, ObjectUpdate, RestReport, SurfacePoint,
};
pub use pose::{
    PoseConsensus, PoseObservation, PoseRansac, PoseRefiner, RansacConfig, RefinedPose, RobustKernel, p3p,
    rigid_alignment,
};

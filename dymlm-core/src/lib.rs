//! Vocabulary of the `dymlm` crates: what a frame, a pose, a camera, a detection and a cloud are.
//!
//! # Conventions
//!
//! - **Frames.** Camera: x right, y down, z forward (optical). World: right-handed, any orientation; nothing
//!   assumes that z is up. A pose is named with both frames: `world_from_camera` takes camera coordinates to
//!   the world. Quaternions are x y z w.
//! - **Pixels.** (0, 0) is the centre of the top-left pixel; u runs right, v down.
//! - **Units.** Metres, seconds, radians.
//! - **Scalars.** Clouds and images are f32; poses, plane and camera parameters f64.
//! - **No reading.** A depth of 0. [`DepthImage`] stores whatever is no reading (NaN, infinite, negative) as
//!   0.
//!
//! No type of another crate appears in a signature, except behind the features `nalgebra_0_35`, `glam_0_33`
//! and `mint_0_5`, which add conversions, and `serde`.
//!
//! ```
//! use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
//!
//! let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?;
//! let depth = DepthImage::new(640, 480, vec![2.0; 640 * 480])?;
//! let frame = Frame::new(0.0, camera, depth, None)?;
//! let world_from_camera = Pose::new([0.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0])?;
//!
//! let point = camera.back_project([319.5, 239.5], frame.depth().at(320, 240).into());
//! assert_eq!(world_from_camera.transform_point(point), [0.0, 0.0, 3.5]);
//! # Ok::<(), dymlm_core::Error>(())
//! ```

mod bits;
mod bounding_box;
mod color_image;
mod config_error;
mod depth_image;
mod depth_noise;
mod depth_registration;
mod detection;
mod distortion;
mod error;
mod frame;
mod ids;
mod interop;
mod letterbox;
mod mask;
mod merged_ids;
mod names;
#[cfg(feature = "serde")]
mod null_is_infinite;
mod organized_cloud;
mod pages;
pub mod paging;
mod pinhole_camera;
mod plane;
mod point;
mod point_cloud;
mod pose;
mod range_end;
mod rectifier;
mod run_lengths;
#[cfg(feature = "state")]
mod saved_state;
mod scratch_file;
mod sensor_model;
mod split_mix64;
mod succession;
mod symmetric_eigen3;
pub mod vector3;
mod visibility;

pub use bits::{BitReader, BitWriter};
pub use bounding_box::BoundingBox;
pub use color_image::{ColorImage, PixelFormat};
pub use config_error::{ConfigError, check_range};
pub use depth_image::DepthImage;
pub use depth_noise::DepthNoise;
pub use depth_registration::DepthRegistration;
pub use detection::Detection;
#[cfg(feature = "serde")]
pub use detection::PackedDetection;
pub use distortion::Distortion;
pub use error::Error;
pub use frame::Frame;
pub use ids::{Birth, FrameId, Numbered, ObjectId, PlaneId, TrackId};
pub use letterbox::Letterbox;
pub use mask::Mask;
pub use merged_ids::MergedIds;
pub use names::Names;
#[cfg(feature = "serde")]
pub use null_is_infinite::null_is_infinite;
pub use organized_cloud::OrganizedCloud;
pub use pages::Pages;
pub use pinhole_camera::{PinholeCamera, check_buffer};
pub use plane::Plane;
pub use point::{Point, Rgb};
pub use point_cloud::PointCloud;
pub use pose::Pose;
pub use rectifier::Rectifier;
pub use run_lengths::RunLengths;
#[cfg(feature = "state")]
pub use saved_state::{DamagedState, StateSink, decode_part, encode_part};
pub use scratch_file::ScratchFile;
pub use sensor_model::SensorModel;
pub use split_mix64::SplitMix64;
pub use succession::Succession;
pub use symmetric_eigen3::{SymmetricEigen3, symmetric_eigen3};
pub use visibility::{DepthView, Sighting, Visibility};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

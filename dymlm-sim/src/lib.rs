//! Synthetic RGB-D scenes with exact truth, and the noise of sensor, detector and poses.
//!
//! A [`Sequence`] shows a [`Room`] in which people walk or sit ([`Activity`]): depth and colour as a depth
//! camera would give them ([`SensorConfig`]), the boxes of a 2D detector with its failures
//! ([`DetectorConfig`]), and beside these what no recording has: exact poses, exact depth, exact masks of the
//! people. [`SequenceType`] names the eight usual sequences, [`SequenceConfig::random_room`] gives another
//! room for each seed, [`SequenceConfig::building`] a floor of a building, [`BuildingPlan`] a building with the
//! walls of a real floor plan. [`Truth`] gathers the exact
//! surfaces, the volume that people swept, flat faces and labelled objects: the truth that the scores of the
//! crate `dymlm-metrics` need.
//!
//! Every frame is a function of the config and its index alone: the same bits in any order, on any number of
//! threads, with the feature `parallel` on or off.
//!
//! ```
//! use dymlm_core::{PinholeCamera, PointCloud};
//! use dymlm_metrics::score_cloud;
//! use dymlm_sim::{Sequence, SequenceConfig, Truth, TruthConfig};
//!
//! let mut config = SequenceConfig::default();
//! config.camera = Some(PinholeCamera::new(80, 60, 65.0, 65.0, 39.5, 29.5)?);
//! config.frames = 4;
//! let sequence = Sequence::new(&config)?;
//!
//! let mut truth = Truth::new(&sequence, &TruthConfig::default())?;
//! let mut points = Vec::new();
//! for frame in sequence.frames() {
//!     truth.observe(&frame);
//!     let camera = frame.frame.camera();
//!     for v in 0..camera.height() {
//!         for u in 0..camera.width() {
//!             let depth = frame.frame.depth().at(u, v);
//!             if depth > 0.0 && depth < 4.0 && !frame.mover_mask.at(u, v) {
//!                 let point = camera.back_project([u as f64, v as f64], depth.into());
//!                 points.push(frame.world_from_camera.transform_point(point).map(|x| x as f32));
//!             }
//!         }
//!     }
//! }
//! let score = score_cloud(&PointCloud::new(points), &truth).ok_or("an empty map")?;
//! assert!(score.median_distance < 0.02 && score.residue < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod detector;
mod noise;
mod render;
mod scene;
mod sensor;
mod sequence;
mod to_pose;
mod truth;

pub use detector::{DetectionRates, DetectorConfig};
pub use scene::{
    Activity, BuildingPlan, CarriedKind, CarriedMotion, CarriedObject, PlanCell, PlanError, PlanGrid, Room,
    SceneEvent,
};
pub use sensor::SensorConfig;
pub use sequence::{
    CameraPath, CarriedThing, FrameScratch, Frames, PlaceChange, PoseErrorConfig, RecordedDrift, SceneChange,
    Sequence, SequenceConfig, SequenceType, SimulatedFrame, VisibleThing,
};
pub use truth::{Truth, TruthConfig};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

//! Synthetic RGB-D scenes with exact truth, sensor and detector noise, and metrics for maps.
//!
//! A [`Sequence`] shows a [`Room`] in which people walk or sit ([`Activity`]): depth and colour as a Kinect would give
//! them ([`SensorConfig`]), the boxes of a 2D detector with its failures ([`DetectorConfig`]), and beside them what no
//! recording has: exact poses, exact depth, exact masks of the people. [`SequenceType`] names the eight usual ones,
//! [`SequenceConfig::random_room`] gives as many others as there are seeds. [`Truth`] gathers the exact surfaces
//! and the volume that people swept, and [`score_cloud`] tells how far a map is from it;
//! its flat faces and labelled objects are what [`score_planes`] and [`score_objects`] score by. For recordings without
//! exact truth there is [`ReferenceCloud`], and for masks [`MaskScore`].
//!
//! Every frame is a function of the config and its index alone: the same bits in any order, on any number of
//! threads, with the feature `parallel` on or off.
//!
//! ```
//! use dymlm_core::{PinholeCamera, PointCloud};
//! use dymlm_sim::{Sequence, SequenceConfig, Truth, TruthConfig, score_cloud};
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
mod metrics;
mod noise;
mod render;
mod scene;
mod sensor;
mod sequence;

pub use detector::{DetectionRates, DetectorConfig};
pub use metrics::{CloudScore, MaskScore, ReferenceCloud, ReferenceScore, Truth, TruthConfig, score_cloud};
pub use metrics::{
    Demand, DuplicateObject, DuplicatePlane, EstimatedObject, EstimatedPlane, FaceScore, FaceState, Facing,
    LabelVerdict, MergedPlane, ObjectMatch, ObjectScore, ObjectScoreConfig, PlaneMatch, PlaneScore,
    PlaneScoreConfig, Spread, TrueFace, TrueObject, YawSymmetry, score_objects, score_planes,
};
pub use metrics::{DetectorFigures, DetectorStatistics, ExactView, FigureRow, SideFigures, SizeFigures};
pub use metrics::{DynamicMapScore, DynamicMapScoreConfig, DynamicMapScorer};
pub use metrics::{FreeSpaceScore, Occupancy, OccupancyScore, OccupancyScoreConfig, OccupancyScorer};
pub use metrics::{IdentifiedBox, TrackingScore, TrackingScoreConfig, TrackingScoreError, TrackingScorer};
pub use metrics::{OccupiedCell, OccupiedCellScore, SurfaceScore};
pub use scene::{Activity, CarriedKind, CarriedMotion, CarriedObject, Room};
pub use sensor::SensorConfig;
pub use sequence::{
    CameraPath, CarriedThing, FrameScratch, PoseErrorConfig, Sequence, SequenceConfig, SequenceType,
    SimulatedFrame, VisibleThing,
};

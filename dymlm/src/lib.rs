//! Multi-level maps of the static world from RGB-D frames, 2D detections and camera poses, while people walk
//! through the scene.
//!
//! After the paper "Multi-level Map Construction for Dynamic Scenes" (X. Hu). A [`MapBuilder`] takes frames
//! one by one and orders the steps of the crates beneath it; [`MultiLevelMap`] holds what has been built:
//!
//! - the dense coloured cloud of what stands still ([`CloudMap`]), people and their traces taken out,
//! - the occupancy octree ([`Octree`]), with the model and the files of `OctoMap`,
//! - the finite planes ([`PlaneMap`]): floor, tables, walls,
//! - the objects ([`ObjectMap`]): boxes and ellipsoids with labels.
//!
//! No ROS, no GPU, no `OpenCV`; on one core a 640x480 key frame takes 14 ms (a recorded
//! kitchen) to 33 ms (a rendered office with much noise) in the median; the same input gives the same bits.
//!
//! ```
//! use dymlm::{MapBuilder, MapConfig, Selection};
//! use dymlm::core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose};
//!
//! let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
//! let mut builder = MapBuilder::new(MapConfig::default())?;
//!
//! // Each frame: images, what the detector saw, and where the camera was.
//! for step in 0..3 {
//!     let depth = DepthImage::new(160, 120, vec![2.0; 160 * 120])?;
//!     let frame = Frame::new(f64::from(step) / 5.0, camera, depth, None)?;
//!     let detections = [Detection::new("person", 0.9, BoundingBox::new(20.0, 0.0, 60.0, 120.0)?)?];
//!     let report = builder.insert(&frame, &detections, &Pose::identity())?;
//!     assert_eq!(report.movers.len(), 1);
//! }
//!
//! // The maps can be read at any time.
//! let cloud = builder.map().cloud().point_cloud(Selection::Static);
//! let octree = builder.map().octree();
//! assert!(!cloud.is_empty() && !octree.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

/// The README's code runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

// Unit tests share fixtures with the integration tests.
#[cfg(test)]
extern crate self as dymlm;
#[cfg(test)]
#[path = "../tests/it/common/mod.rs"]
mod common;

mod carried_object;
mod correction;
mod detections;
mod error;
#[cfg(feature = "io")]
pub mod files;
mod frame_input;
mod frame_report;
mod ghost_removal;
mod key_frame_view;
mod key_frames;
mod late_detections;
mod logged_sessions;
mod map_builder;
mod map_bytes;
mod map_changes;
mod map_config;
mod map_counts;
mod map_memory;
mod map_pager;
mod map_reader;
mod memory_config;
mod merge;
mod multi_level_map;
mod parallel;
mod past;
mod publisher;
mod queries;
#[cfg(test)]
mod random_session;
#[cfg(feature = "refine")]
mod refinement;
mod replay;
mod scans;
mod session_changes;
mod session_clock;
mod session_log;
mod sessions;
mod snapshots;
mod stages;
mod subsampler;
mod supporting_planes;
mod waiting_frames;
mod witnesses;
mod world_changes;

pub use dymlm_cloud as cloud;
pub use dymlm_core as core;
pub use dymlm_dynamics as dynamics;
pub use dymlm_geometry as geometry;
pub use dymlm_history as history;
pub use dymlm_objects as objects;
pub use dymlm_octree as octree;
pub use dymlm_planes as planes;
pub use dymlm_tracking as tracking;

pub use dymlm_cloud::{CloudMap, Selection};
pub use dymlm_history::HistoryConfig;
pub use dymlm_objects::ObjectMap;
pub use dymlm_octree::Octree;
pub use dymlm_planes::PlaneMap;

pub use carried_object::ObjectMove;
pub use correction::{CorrectionProgress, CorrectionReport, ThingChanges, ThingMotion};
pub use detections::Detections;
pub use error::Error;
pub use frame_input::FrameInput;
pub use frame_report::{FrameOutcome, FrameReport, MapUpdate, ScanUpdate};
pub use key_frames::KeyFrameConfig;
pub use logged_sessions::MapSession;
pub use map_builder::MapBuilder;
pub use map_changes::{ChangedThings, MapChanges};
pub use map_config::MapConfig;
pub use map_counts::MapCounts;
pub use map_memory::MapMemory;
pub use map_reader::{MapReader, Revision};
pub use memory_config::MemoryConfig;
pub use merge::{MergeReport, MergedSession, NewIds};
pub use multi_level_map::MultiLevelMap;
pub use queries::{FloorGrid, FloorGridConfig, FloorUnder};
#[cfg(feature = "refine")]
pub use refinement::{LoopClosure, MotionKind, RefineConfig, RefineReport, RefinedPoses, UnheldMotion};
pub use session_changes::SessionChanges;
pub use stages::{Stage, StageTimes};
pub use world_changes::{FoundObject, MovedObject, WorldChanges};

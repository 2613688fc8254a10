//! The dense coloured cloud of the static world: weighted voxels, and the evidence that decides which of them
//! stand still.
//!
//! Paper III-A. See [`CloudMap`].

mod block_changes;
mod block_store;
mod block_sums;
mod body_motion;
mod cell_counts;
mod changes;
mod cloud_map;
mod config;
mod depth_tiles;
mod direction;
mod epochs;
mod error;
mod evidence;
mod finding;
mod fixed_point;
mod forgetting;
mod frame_readings;
mod frame_reads;
mod frame_scratch;
mod free_space;
mod look_through;
mod mover_masks;
mod opinion;
mod packed_counts;
mod paging;
mod parallel;
mod place_history;
mod places;
mod plain_counts;
mod queries;
mod rounding;
#[cfg(feature = "state")]
mod saved_state;
mod scan;
mod shared_kept;
mod slot_index;
mod slot_numbers;
mod stamps;
mod static_cloud;
mod support;
mod thinning;
mod verdict;
mod verdicts;
mod voxel;
mod voxel_block;
mod voxel_records;
mod weighting;

pub use block_changes::CloudBlock;
pub use body_motion::BodyMotion;
pub use cloud_map::{CloudFrameReport, CloudMap, CloudVoxel, Selection};
pub use config::CloudMapConfig;
pub use error::Error;
pub use mover_masks::MoverMasks;
pub use paging::CloudPager;
pub use place_history::{PlaceHistory, PlacePeriod};
pub use queries::{PointHit, StaticPoint, StaticPoints, SurfaceNormal};
#[cfg(feature = "state")]
pub use saved_state::{CloudLoader, SavedCloud};
pub use support::Support;
pub use verdict::Verdict;
pub use verdicts::Verdicts;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

//! The dense cloud of the static world: weighted voxels, and the evidence that decides which of them stand still.
//!
//! Paper III-A, DESIGN 4.2. See [`CloudMap`].

mod block_store;
mod body_motion;
mod config;
mod depth_tiles;
mod error;
mod evidence;
mod fixed_point;
mod look_through;
mod map;
mod rounding;
mod thinning;
mod verdict;
mod voxel;
mod voxel_block;

pub use body_motion::BodyMotion;
pub use config::{CloudMapConfig, EvidenceConfig, ThinningConfig};
pub use error::CloudMapError;
pub use evidence::Support;
pub use map::{CloudFrameReport, CloudMap, CloudVoxel, Selection};
pub use verdict::Verdict;

//! The map of finite planes. See [`PlaneMap`].

mod config;
mod fixed_moments;
mod gap;
mod gap_record;
mod insertion;
mod judgement;
mod key_frame;
mod label_code;
mod looks;
mod map;
mod map_plane;
mod placed_share;
mod plane_sighting;
mod report;
mod step;

pub use config::PlaneMapConfig;
pub use map::PlaneMap;
pub use map_plane::MapPlane;
pub use plane_sighting::PlaneSighting;
pub use report::{PlaneMerge, PlaneReport};

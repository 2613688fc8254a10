//! The objects of the world and what is known of each: [`ObjectMap`].

mod box_motion;
mod centroid_cloud;
mod counter;
mod detected_share;
mod key_views;
mod label_evidence;
mod map;
mod map_object;
mod moved_object;
mod object_cloud;
mod queries;
mod seen_apart;
mod sighted_points;
mod sighting;
mod sightings;
mod space_index;
mod view_weight;

pub(crate) use box_motion::BoxMotion;
pub use centroid_cloud::CentroidCloud;
pub(crate) use counter::counted;
pub(crate) use detected_share::DetectedShare;
pub(crate) use key_views::{KeyView, KeyViews};
pub use label_evidence::LabelEvidence;
pub use map::ObjectMap;
pub(crate) use map_object::{GROWTH, ObjectLimits};
pub use map_object::{MapObject, ObjectState};
pub(crate) use object_cloud::{CloudPatch, ObjectCloud};
pub use queries::RayHit;
pub(crate) use seen_apart::SeenApart;
pub(crate) use sighted_points::SightedPoints;
pub use sighting::ObjectSighting;
pub(crate) use sightings::Sightings;
pub(crate) use space_index::SpaceIndex;
pub(crate) use view_weight::{FULL, ViewWeight};

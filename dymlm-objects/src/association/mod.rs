//! Association of detections with objects: [`AssociationTests`] and one assignment per frame.

mod associator;
mod centroid_test;
mod config;
mod joint_box;
mod projection_iou;
mod shared_points;

pub use associator::AssociationTests;
pub(crate) use associator::Associator;
pub use centroid_test::{CentroidTest, CentroidVerdict};
pub use config::AssociationConfig;
pub(crate) use joint_box::JointBox;
use joint_box::joint_iou;
pub(crate) use projection_iou::visible_iou;
pub(crate) use shared_points::sample_places;

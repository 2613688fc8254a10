//! A map of objects from RGB-D frames and 2D detections.
//!
//! This is the object map of `DyMLM` (paper IV). The types of each step:
//!
//! | step | type |
//! | --- | --- |
//! | from a detection's pixels to a box in space | [`ObjectObservation`], [`BoxFitter`] |
//! | association of detections with objects | [`AssociationTests`], [`CentroidTest`] |
//! | points, outliers, new parameters, labels | [`MapObject`] |
//! | duplicates and ghosts | [`ObjectMerge`], [`ObjectReport`] |
//! | cuboid or ellipsoid, and its outline in an image | [`ObjectShape`], [`DualQuadric`] |
//! | objects by label, place, ray, plane | [`ObjectMap`] |
//!
//! [`ObjectMapper`] runs the steps in this order. Supporting planes may come from any plane map
//! ([`SupportingPlanes`]), the static mask from any preprocessing ([`ObjectView`]).

mod association;
mod config;
mod error;
mod labels;
mod mapper;
mod object_map;
mod optimization;
mod parameterization;
mod pushed_objects;
mod quantiles;
mod renaming;
mod report;
#[cfg(feature = "state")]
mod saved_state;
mod shape;
mod support;
mod view;

pub use association::{AssociationConfig, AssociationTests, CentroidTest, CentroidVerdict};
pub use config::ObjectConfig;
pub use error::Error;
pub use labels::{Footprint, ShapeKind, ShapeTable, SizePrior, SizePriors, SizeRange, UprightPose};
pub use mapper::ObjectMapper;
pub use object_map::{
    CentroidCloud, LabelEvidence, MapObject, ObjectMap, ObjectSighting, ObjectState, RayHit,
};
pub use optimization::UpdateConfig;
pub use parameterization::{
    BoxAxes, BoxFit, BoxFitter, BoxFitterConfig, Completeness, ObjectObservation, ParameterizationConfig,
    Relief, SideView,
};
pub use report::{ObjectAssociation, ObjectMerge, ObjectReport, RejectedDetection, RejectionCause};
pub use shape::{DualQuadric, ImageEllipse, ObjectShape};
pub use support::{NoPlanes, SupportPlane, SupportingPlanes};
pub use view::{ObjectView, SightedPoint};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

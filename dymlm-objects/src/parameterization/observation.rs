use dymlm_core::{BoundingBox, Point};

use super::{BoxFit, Completeness};
use crate::SupportPlane;

/// What one frame shows of an object: a detection in space.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectObservation {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// The detector's label.
    pub label: String,
    /// The detector's score, 0..=1.
    pub score: f32,
    /// The detector's box, pixels.
    pub bounding_box: BoundingBox,
    /// Smoothed surface points, in the camera frame.
    pub points: Vec<Point>,
    /// Mean of the points, in the world.
    pub centroid: [f64; 3],
    /// The box around the points, in the world.
    pub fit: BoxFit,
    /// The plane on which the object stands, when one was found.
    pub support: Option<SupportPlane>,
    /// Whether depth or only colour told it from its surroundings.
    pub relief: Relief,
    /// How much of the object is seen.
    pub completeness: Completeness,
    /// Ids of the caller's map points on it, ascending.
    pub sighted_points: Vec<u64>,
}

/// How an object differs from its surroundings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Relief {
    /// It stands out in depth.
    #[default]
    Raised,
    /// It lies flat on a plane and differs from it only in colour.
    Flat,
}

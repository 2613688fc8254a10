use crate::Spread;
use crate::share::share;

/// How a map's objects compare with the true ones; see [`score_objects`](crate::score_objects) for the
/// formulas.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectScore {
    /// Number of estimates scored.
    pub estimates: usize,
    /// Number of true objects asked for.
    pub asked: usize,
    /// Estimates that match an object, by ascending index.
    pub matches: Vec<ObjectMatch>,
    /// Ids of the objects asked for without a match, ascending.
    pub missed: Vec<usize>,
    /// Indices of the estimates that match no object, ascending; duplicates are among them.
    pub unmatched: Vec<usize>,
    /// Estimates without a match at the place of a matched object, by ascending index.
    pub duplicates: Vec<DuplicateObject>,
    /// Mean intersection over union of the matches; `None` without a match.
    pub mean_iou: Option<f64>,
    /// Distances between the centres of the matches, metres; `None` without a match.
    pub center_error: Option<Spread>,
    /// Yaw errors of the matches that have one, degrees; `None` when none has.
    pub yaw_error_degrees: Option<Spread>,
}

/// An estimate that matches an object.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectMatch {
    /// Index of the estimate.
    pub estimate: usize,
    /// Id of the true object.
    pub object: usize,
    /// Whether the object was asked for. Other objects are visible in too few frames, and are not counted in
    /// recall.
    pub demand: Demand,
    /// Intersection over union of the boxes' volumes.
    pub iou: f64,
    /// Distance between the centres, metres.
    pub center_error: f64,
    /// Angle about the vertical between the boxes, up to the object's symmetry, degrees; `None` for a round
    /// object.
    pub yaw_error_degrees: Option<f64>,
    /// Whether the labels are the same.
    pub label: LabelVerdict,
}

/// Whether a map is asked to contain an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Demand {
    /// The object is visible in enough frames.
    Asked,
    /// The object is visible in too few frames.
    Optional,
}

/// Whether an estimate has its object's label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum LabelVerdict {
    /// The labels are the same.
    Right,
    /// The labels differ.
    Wrong,
}

/// A second estimate of an object, beside the one that matches it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct DuplicateObject {
    /// Index of the estimate.
    pub estimate: usize,
    /// Index of the estimate that matches the object.
    pub of: usize,
}

impl ObjectScore {
    /// Share of the objects asked for that have a match; `None` when none is asked for.
    pub fn recall(&self) -> Option<f64> {
        share((self.asked - self.missed.len()) as u64, self.asked as u64)
    }

    /// Share of the estimates that have a match; `None` without estimates.
    pub fn precision(&self) -> Option<f64> {
        share(self.matches.len() as u64, self.estimates as u64)
    }

    /// Share of the matches that have the right label; `None` without a match.
    pub fn label_accuracy(&self) -> Option<f64> {
        let right = self.matches.iter().filter(|found| found.label == LabelVerdict::Right).count();
        share(right as u64, self.matches.len() as u64)
    }
}

use dymlm_core::ObjectId;

use crate::AssociationTests;

/// What a frame changed in the object map.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectReport {
    /// Detections that were associated with an object, by ascending index.
    pub associated: Vec<ObjectAssociation>,
    /// The object that each detection observed, whether associated with it or the reason for creating it, by
    /// ascending index of the detections.
    pub observed: Vec<(usize, ObjectId)>,
    /// New objects, ascending ids; tentative until they are seen again.
    pub created: Vec<ObjectId>,
    /// Objects that got new parameters, ascending ids.
    pub updated: Vec<ObjectId>,
    /// Objects whose new parameters were not accepted, ascending ids.
    pub kept_parameters: Vec<ObjectId>,
    /// Newly confirmed objects, ascending ids.
    pub confirmed: Vec<ObjectId>,
    /// Objects that are candidates again, ascending ids: they were detected too seldom while in view, have
    /// an implausible size for their label, or no view shows enough of their new box.
    pub unconfirmed: Vec<ObjectId>,
    /// Objects that were merged into others, in the order of the merges.
    pub merged: Vec<ObjectMerge>,
    /// Objects that were removed because they are not there, ascending ids.
    pub removed: Vec<ObjectId>,
    /// Detections that were not used, by ascending index.
    pub rejected: Vec<RejectedDetection>,
}

/// A detection and the object with which it was associated.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectAssociation {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Id of the object.
    pub object: ObjectId,
    /// Results of the tests.
    pub tests: AssociationTests,
}

/// Two objects that were merged into one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectMerge {
    /// Id of the object that stays.
    pub kept: ObjectId,
    /// Id of the object that was merged into it.
    pub removed: ObjectId,
}

/// A detection that was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RejectedDetection {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Why it was not used.
    pub cause: RejectionCause,
}

/// Why a detection was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RejectionCause {
    /// There is no cluster of static readings in its box.
    NoPoints,
    /// What is in its box is too large for its label.
    Size,
    /// Most of its points lie within a confirmed object of the map with which it was not associated, or it
    /// was associated with an object that somebody carries.
    Occupied,
    /// A confirmed object, which no detection was associated with, projects to its box and is visible; what
    /// was found in the box is before or behind that object.
    Explained,
}

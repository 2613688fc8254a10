use dymlm_core::ObjectId;

use crate::AssociationTests;

/// What a frame changed in the object map.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectReport {
    /// Detections that were associated with an object, by ascending index.
    pub associated: Vec<ObjectAssociation>,
    /// The object that each detection is of, associated with it or the first of it, by ascending index of the
    /// detections.
    pub observed: Vec<(usize, ObjectId)>,
    /// Objects that are new, ascending ids; tentative until they are seen again.
    pub created: Vec<ObjectId>,
    /// Objects that got new parameters, ascending ids.
    pub updated: Vec<ObjectId>,
    /// Objects whose new parameters were not accepted, ascending ids.
    pub kept_parameters: Vec<ObjectId>,
    /// Objects that are confirmed from now on, ascending ids.
    pub confirmed: Vec<ObjectId>,
    /// Objects that are candidates again, ascending ids: the detector too seldom finds what is in view, or no
    /// thing of the label is of that size.
    pub unconfirmed: Vec<ObjectId>,
    /// Objects that went into others, in the order in which that happened.
    pub merged: Vec<ObjectMerge>,
    /// Objects that are not there, ascending ids.
    pub removed: Vec<ObjectId>,
    /// Detections that came to nothing, by ascending index.
    pub rejected: Vec<RejectedDetection>,
}

/// A detection that is of an object of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectAssociation {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Id of the object.
    pub object: ObjectId,
    /// What the tests said.
    pub tests: AssociationTests,
}

/// Two objects that are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectMerge {
    /// Id of the object that stays.
    pub kept: ObjectId,
    /// Id of the object that went into it.
    pub removed: ObjectId,
}

/// A detection that came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RejectedDetection {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Why.
    pub cause: RejectionCause,
}

/// Why a detection came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RejectionCause {
    /// There is no cluster of static readings in its box.
    NoPoints,
    /// No thing of its label is of the size of what is in its box.
    Size,
    /// It lies within an object of the map but was not associated with it.
    Occupied,
    /// A confirmed object that no other detection is of projects to its box, but what was found in the box is
    /// before or behind that object.
    Explained,
}

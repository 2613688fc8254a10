use crate::AssociationTests;

/// What a frame changed in the object map.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct ObjectReport {
    /// Detections that were associated with an object, by ascending index.
    pub associated: Vec<ObjectAssociation>,
    /// Objects that are new, ascending ids; tentative until they are seen again.
    pub created: Vec<u64>,
    /// Objects that got new parameters, ascending ids.
    pub updated: Vec<u64>,
    /// Objects whose new parameters were not accepted, ascending ids.
    pub kept_parameters: Vec<u64>,
    /// Objects that are believed from now on, ascending ids.
    pub confirmed: Vec<u64>,
    /// Objects that are no longer believed, ascending ids: the detector too seldom finds what is in view, or
    /// the size is none for the label.
    pub doubted: Vec<u64>,
    /// Objects that went into others, in the order in which that happened.
    pub merged: Vec<ObjectMerge>,
    /// Objects that are not there, ascending ids.
    pub removed: Vec<u64>,
    /// Detections that came to nothing, by ascending index.
    pub rejected: Vec<RejectedDetection>,
}

/// A detection that is of an object of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ObjectAssociation {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Id of the object.
    pub object: u64,
    /// What the tests said.
    pub tests: AssociationTests,
}

/// Two objects that are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct ObjectMerge {
    /// Id of the object that stays.
    pub kept: u64,
    /// Id of the object that went into it.
    pub removed: u64,
}

/// A detection that came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RejectedDetection {
    /// Index of the detection in its frame.
    pub detection: usize,
    /// Why.
    pub cause: RejectionCause,
}

/// Why a detection came to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RejectionCause {
    /// There is no cluster of static readings in its box.
    NoPoints,
    /// What is in its box is of no size that things of its label have.
    Size,
    /// It lies within an object of the map but was not associated with it.
    Occupied,
    /// An object of the map that no other detection is of looks like it, but something else was found in the box.
    Explained,
}

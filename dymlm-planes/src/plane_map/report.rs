use dymlm_core::{FrameId, PlaneId};

use crate::detector::RejectedPlane;

/// A merge of two planes of the map that proved to be one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneMerge {
    /// The plane that was merged into the other; its id leads to the other from now on.
    pub from: PlaneId,
    /// The plane that remains.
    pub into: PlaneId,
}

/// What a key frame has changed in the map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneReport {
    /// Id of the key frame, by which it can be removed again.
    #[doc(alias = "keyframe")]
    pub key_frame: FrameId,
    /// New planes, ascending ids.
    pub created: Vec<PlaneId>,
    /// Planes that were seen again, ascending ids.
    pub updated: Vec<PlaneId>,
    /// Merges of planes, in the order in which they happened.
    pub merged: Vec<PlaneMerge>,
    /// For each detected plane, the map plane that contains it now.
    pub associations: Vec<PlaneId>,
    /// Detected planes that the filter kept out of the map; empty when a [`PlaneMap`](crate::PlaneMap) is
    /// used alone, because it does not see them.
    pub rejected: Vec<RejectedPlane>,
}

use dymlm_core::{FrameId, PlaneId};

use crate::detector::RejectedPlane;

/// Two planes of the map that proved to be one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneMerge {
    /// The plane that has gone; its id leads to the other from now on.
    pub from: PlaneId,
    /// The plane that holds both now.
    pub into: PlaneId,
}

/// What a key frame has done to the map.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneReport {
    /// Id of the key frame, by which it can be taken out again.
    #[doc(alias = "keyframe")]
    pub key_frame: FrameId,
    /// Planes that are new, ascending.
    pub created: Vec<PlaneId>,
    /// Planes that were seen again, ascending.
    pub updated: Vec<PlaneId>,
    /// Planes that proved to be one, in the order in which they merged.
    pub merged: Vec<PlaneMerge>,
    /// For each detected plane the map plane that holds it now.
    pub associations: Vec<PlaneId>,
    /// Detected planes that the filter kept from the map; a [`PlaneMap`](crate::PlaneMap) alone, which does
    /// not see them, leaves it empty.
    pub rejected: Vec<RejectedPlane>,
}

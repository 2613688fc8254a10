use std::collections::BTreeMap;

use dymlm_core::{FrameId, ObjectId, PlaneId};

/// What merging maps has done.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MergeReport {
    /// The sessions of both, in the order in which they are mapped.
    pub sessions: Vec<MergedSession>,
    /// Key frames in the maps.
    pub key_frames: usize,
    /// Those of them that were mapped again.
    pub mapped_again: usize,
    /// What the things of the map that was merged into are called now.
    pub own: NewIds,
    /// What the other's are.
    pub other: NewIds,
}

/// A session of maps that were merged.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MergedSession {
    /// Its first frame.
    pub first: FrameId,
    /// How many there are; their ids follow.
    pub frames: usize,
    /// What the first was in the map that was merged into; none where it was not.
    pub own: Option<FrameId>,
    /// What it was in the other; a session that both knew is there once.
    pub other: Option<FrameId>,
}

/// What the planes and objects of a map are called after it was merged with another: things of both with the
/// same name are one. What is in the maps no more is not named.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NewIds {
    /// Planes: what they were, and what they are.
    pub planes: BTreeMap<PlaneId, PlaneId>,
    /// Objects.
    pub objects: BTreeMap<ObjectId, ObjectId>,
}

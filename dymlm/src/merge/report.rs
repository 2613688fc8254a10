use std::collections::BTreeMap;

use dymlm_core::{FrameId, ObjectId, PlaneId};

/// What merging maps has done.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MergeReport {
    /// The sessions of both maps, in the order in which they are mapped.
    pub sessions: Vec<MergedSession>,
    /// Key frames in the maps.
    pub key_frames: usize,
    /// Key frames that were mapped again.
    pub mapped_again: usize,
    /// The new ids of the things of the map that was merged into.
    pub own: NewIds,
    /// The new ids of the other map's things.
    pub other: NewIds,
}

/// A session of maps that were merged.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MergedSession {
    /// Its first frame.
    pub first: FrameId,
    /// Its number of frames and scans, whose ids are consecutive.
    pub frames: usize,
    /// Its first frame in the map that was merged into; none if the session was not there.
    pub own: Option<FrameId>,
    /// Its first frame in the other map; a session that both maps hold is there once.
    pub other: Option<FrameId>,
}

/// The new ids of the planes and objects of a map after it was merged with another: things of both maps with
/// the same new id are one. Things that are no longer in the maps are left out.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NewIds {
    /// Planes: old id -> new id.
    pub planes: BTreeMap<PlaneId, PlaneId>,
    /// Objects: old id -> new id.
    pub objects: BTreeMap<ObjectId, ObjectId>,
}

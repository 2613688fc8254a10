use dymlm_core::{ObjectId, PlaneId};

/// What a correction of poses has done.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CorrectionReport {
    /// Key frames in the maps.
    pub key_frames: usize,
    /// Key frames whose pose has changed.
    pub moved_key_frames: usize,
    /// The farthest that a reading can have moved by the change of its key frame's pose, metres: the
    /// translation, and the rotation times the sensor's range.
    pub largest_motion: f64,
    /// The planes.
    pub planes: ThingChanges<PlaneId>,
    /// The objects.
    pub objects: ThingChanges<ObjectId>,
}

impl CorrectionReport {
    /// The report when the maps are as they were.
    pub(super) fn unchanged(key_frames: usize) -> Self {
        Self {
            key_frames,
            moved_key_frames: 0,
            largest_motion: 0.0,
            planes: ThingChanges::none(),
            objects: ThingChanges::none(),
        }
    }
}

/// What has become of planes or objects. A thing keeps its id when most of the observations that it shares
/// with one of before are of that one.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ThingChanges<Id> {
    /// Those that were there before and stand elsewhere now, ascending.
    pub moved: Vec<ThingMotion<Id>>,
    /// Those that are one with another now, and that other; their ids lead there.
    pub merged: Vec<(Id, Id)>,
    /// Those of which a part has become another, and that other.
    pub split: Vec<(Id, Id)>,
    /// Those that are there no more, ascending.
    pub vanished: Vec<Id>,
    /// Those that were not there before, nor a part of another, ascending.
    pub appeared: Vec<Id>,
}

impl<Id> ThingChanges<Id> {
    fn none() -> Self {
        Self {
            moved: Vec::new(),
            merged: Vec::new(),
            split: Vec::new(),
            vanished: Vec::new(),
            appeared: Vec::new(),
        }
    }
}

/// How far a thing has moved.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ThingMotion<Id> {
    /// The thing.
    pub id: Id,
    /// Distance between its centres before and now, metres.
    pub distance: f64,
}

/// How far a correction has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct CorrectionProgress {
    /// Key frames that have been mapped again.
    pub done: usize,
    /// Key frames that are to be.
    pub total: usize,
}

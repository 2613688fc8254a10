use dymlm_core::{FrameId, ObjectId, PlaneId, Pose};

use crate::session_log::{Event, SessionLog};

/// What a correction of poses has done.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CorrectionReport {
    /// Key frames and scans in the maps.
    pub key_frames: usize,
    /// Key frames and scans whose pose has changed.
    pub moved_key_frames: usize,
    /// Bound of how far a reading has moved by the change of its frame's or scan's pose, metres: the largest
    /// sum of the translation, and the rotation times the sensor's range.
    pub largest_motion: f64,
    /// The motion of the newest frame, `new_from_old`, with which everything moves that goes on from it: the poses
    /// of frames to come, and what is followed outside of the maps
    /// ([`ObjectTracker::move_world`](dymlm_tracking::ObjectTracker::move_world)). The identity when it stayed.
    pub new_from_old: Pose,
    /// The planes.
    pub planes: ThingChanges<PlaneId>,
    /// The objects.
    pub objects: ThingChanges<ObjectId>,
}

impl CorrectionReport {
    /// The report when the maps are as they were.
    pub(super) fn unchanged(log: &SessionLog) -> Self {
        Self {
            key_frames: log.events.iter().filter_map(Event::mapped).count(),
            moved_key_frames: 0,
            largest_motion: 0.0,
            new_from_old: Pose::identity(),
            planes: ThingChanges::none(),
            objects: ThingChanges::none(),
        }
    }

    /// Notes how the key frames and scans have moved; `old` and `new`: the poses of all frames, by id.
    pub(super) fn note_motions(&mut self, log: &SessionLog, max_depth: f32, [old, new]: [&[Pose]; 2]) {
        let motion = |frame: FrameId| {
            let place = frame.get() as usize;
            let (old, new) = (&old[place], &new[place]);
            (old != new).then(|| old.distance(new) + f64::from(max_depth) * old.angle(new))
        };
        let motions: Vec<f64> = log.events.iter().filter_map(Event::mapped).filter_map(motion).collect();
        self.moved_key_frames = motions.len();
        self.largest_motion = motions.into_iter().fold(0.0, f64::max);
    }
}

/// What has become of planes or objects. A thing keeps the id of the earlier thing with which it shares most
/// observations.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ThingChanges<Id> {
    /// Those that were there before and stand elsewhere now, ascending.
    pub moved: Vec<ThingMotion<Id>>,
    /// Those that were merged into another, with that other; their ids lead to it.
    pub merged: Vec<(Id, Id)>,
    /// Those that were split, with the new thing that a part of them has become.
    pub split: Vec<(Id, Id)>,
    /// Those that are no longer there, ascending.
    pub vanished: Vec<Id>,
    /// Those that were not there before, and are no part of an earlier thing, ascending.
    pub appeared: Vec<Id>,
}

impl<Id> ThingChanges<Id> {
    pub(super) fn none() -> Self {
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
    /// Key frames and scans that have been mapped again.
    pub done: usize,
    /// Key frames and scans that are to be mapped again, in all.
    pub total: usize,
}

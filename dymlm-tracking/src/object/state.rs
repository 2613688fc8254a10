use dymlm_core::Pose;

/// The state of a tracked object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum ObjectState {
    /// It stands still, and has for a while. It stays in this state while no point of it is found, if it is
    /// out of view or the depth shows its surface in place: an untouched object stays.
    AtRest,
    /// Its pose is known, and it moves or may be about to stop.
    Tracking,
    /// Something occludes most of it, or it has just vanished. Its pose is a guess unless points agree on it.
    Occluded,
    /// It has not been seen for longer than
    /// [`ObjectTrackerConfig::lost_after`](crate::ObjectTrackerConfig::lost_after).
    Lost,
    /// It was lost or had vanished, and has been found again in this frame.
    Recovered,
}

/// The object came to rest at a new place.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RestReport {
    /// Its pose now.
    pub world_from_object: Pose,
    /// Its pose before it was moved: that place is empty now.
    pub moved_from: Pose,
    /// Time since which it has been there, seconds.
    pub since: f64,
}

use dymlm_core::Pose;

/// What is known of a followed object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum ObjectState {
    /// It stands where it stood for a while. Also while no point of it is found, if it is out of view or the
    /// depth shows its surface in its place: what nobody touches stays.
    AtRest,
    /// It moves, or may be about to stop, and its pose is known.
    Tracking,
    /// Something stands before most of it, or it has just vanished: its pose is a guess unless points say so.
    Occluded,
    /// It has not been seen for longer than
    /// [`ObjectTrackerConfig::lost_after`](crate::ObjectTrackerConfig::lost_after).
    Lost,
    /// It was lost or vanished, and has been found again in this frame.
    Recovered,
}

/// An object came to rest at a place other than the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RestReport {
    /// Where it stands now.
    pub world_from_object: Pose,
    /// Where it stood before it was moved: the place that is empty now.
    pub moved_from: Pose,
    /// Time since which it has stood there, seconds.
    pub since: f64,
}

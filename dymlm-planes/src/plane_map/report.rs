use crate::filter::RejectedPlane;

/// Two planes of the map that proved to be one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PlaneMerge {
    /// The plane that has gone.
    pub from: u64,
    /// The plane that holds both now.
    pub into: u64,
}

/// What a key frame has done to the map.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct PlaneReport {
    /// Number of the key frame, by which it can be taken out again.
    pub key_frame: u64,
    /// Ids of planes that are new, ascending.
    pub created: Vec<u64>,
    /// Ids of planes that were seen again, ascending.
    pub updated: Vec<u64>,
    /// Planes that proved to be one, in the order in which they merged.
    pub merged: Vec<PlaneMerge>,
    /// For each detected plane the id of the map plane that holds it now.
    pub associations: Vec<u64>,
    /// Detected planes that the filter kept from the map; a [`PlaneMap`](crate::PlaneMap) alone, which does not see them, leaves
    /// it empty.
    pub rejected: Vec<RejectedPlane>,
}

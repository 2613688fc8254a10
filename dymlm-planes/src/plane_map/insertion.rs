use dymlm_core::{Birth, FrameId, Names, PlaneId, record};

use super::report::{PlaneMerge, PlaneReport};

/// A merge of two planes of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Union {
    /// The plane that was merged into the other.
    pub(super) from: Birth,
    /// The plane that remains.
    pub(super) into: Birth,
}

record!(Union { from, into });

/// What a key frame changes in the map, with planes given by their births.
#[derive(Debug)]
pub(super) struct Insertion {
    pub(super) key_frame: FrameId,
    /// Planes that are new, ascending.
    pub(super) created: Vec<Birth>,
    /// Planes that were seen again, ascending.
    pub(super) updated: Vec<Birth>,
    /// Merges, in the order in which they happened.
    pub(super) unions: Vec<Union>,
    /// For each detected plane, the map plane that contains it now.
    pub(super) associations: Vec<Birth>,
}

impl Insertion {
    pub(super) fn of(key_frame: FrameId) -> Self {
        Self {
            key_frame,
            created: Vec::new(),
            updated: Vec::new(),
            unions: Vec::new(),
            associations: Vec::new(),
        }
    }

    /// The planes that are new or were seen again.
    pub(super) fn touched(&self) -> impl Iterator<Item = Birth> {
        self.created.iter().chain(&self.updated).copied()
    }

    /// The report for callers, with planes given by their ids.
    pub(super) fn report(&self, names: &Names<PlaneId>) -> PlaneReport {
        let called = |births: &[Birth]| births.iter().map(|&birth| names.id(birth)).collect();
        let sorted = |births: &[Birth]| {
            let mut ids: Vec<PlaneId> = called(births);
            ids.sort_unstable();
            ids
        };
        let merge = |union: &Union| PlaneMerge { from: names.id(union.from), into: names.id(union.into) };
        PlaneReport {
            key_frame: self.key_frame,
            created: sorted(&self.created),
            updated: sorted(&self.updated),
            merged: self.unions.iter().map(merge).collect(),
            associations: called(&self.associations),
            rejected: Vec::new(),
        }
    }
}

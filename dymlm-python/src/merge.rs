//! Reports of merged maps.

use std::collections::BTreeMap;

use dymlm::core::{FrameId, Numbered};
use dymlm::{MergeReport, MergedSession, NewIds};
use pyo3::prelude::*;

/// What merging two maps has done.
#[pyclass(frozen, get_all, name = "MergeReport", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMergeReport {
    /// The sessions of both, in the order in which they are mapped: a list of (first frame, number of frames,
    /// first frame in this map before or None, first frame in the other or None).
    sessions: Vec<(u64, usize, Option<u64>, Option<u64>)>,
    /// Key frames in the maps.
    key_frames: usize,
    /// Number of these key frames that were mapped again.
    mapped_again: usize,
    /// New ids of the things of the map that was merged into, NewIds.
    own: PyNewIds,
    /// New ids of the things of the other map, NewIds.
    other: PyNewIds,
}

impl PyMergeReport {
    pub(crate) fn of(report: &MergeReport) -> Self {
        let session = |one: &MergedSession| {
            (one.first.get(), one.frames, one.own.map(FrameId::get), one.other.map(FrameId::get))
        };
        Self {
            sessions: report.sessions.iter().map(session).collect(),
            key_frames: report.key_frames,
            mapped_again: report.mapped_again,
            own: PyNewIds::of(&report.own),
            other: PyNewIds::of(&report.other),
        }
    }
}

/// The ids of a map's planes and objects after merging. Things of the two maps that have the same new id are
/// the same thing.
#[pyclass(frozen, get_all, name = "NewIds", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyNewIds {
    /// Planes: old id to new.
    planes: BTreeMap<u64, u64>,
    /// Objects: old id to new.
    objects: BTreeMap<u64, u64>,
}

impl PyNewIds {
    fn of(ids: &NewIds) -> Self {
        fn numbers<Id: Numbered>(ids: &BTreeMap<Id, Id>) -> BTreeMap<u64, u64> {
            ids.iter().map(|(old, new)| (old.number(), new.number())).collect()
        }
        Self { planes: numbers(&ids.planes), objects: numbers(&ids.objects) }
    }
}

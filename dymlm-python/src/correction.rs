//! What corrections of poses have done.

use std::collections::BTreeMap;

use dymlm::core::{FrameId, Numbered};
use dymlm::{CorrectionReport, LoopClosure, RefineReport, ThingChanges};
use pyo3::prelude::*;

use crate::pose::PoseArgument;

/// What a correction of poses has done.
#[pyclass(frozen, get_all, name = "CorrectionReport", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyCorrectionReport {
    /// Key frames in the maps.
    key_frames: usize,
    /// Key frames whose pose has changed.
    moved_key_frames: usize,
    /// The farthest that a reading can have moved, metres.
    largest_motion: f64,
    /// What has become of the planes, ThingChanges.
    planes: PyThingChanges,
    /// What has become of the objects, ThingChanges.
    objects: PyThingChanges,
}

#[pymethods]
impl PyCorrectionReport {
    fn __repr__(&self) -> String {
        format!("<dymlm.CorrectionReport: {} of {} key frames moved>", self.moved_key_frames, self.key_frames)
    }
}

impl PyCorrectionReport {
    pub(crate) fn of(report: &CorrectionReport) -> Self {
        Self {
            key_frames: report.key_frames,
            moved_key_frames: report.moved_key_frames,
            largest_motion: report.largest_motion,
            planes: PyThingChanges::of(&report.planes),
            objects: PyThingChanges::of(&report.objects),
        }
    }
}

/// What has become of planes or objects, by their ids.
#[pyclass(frozen, get_all, name = "ThingChanges", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyThingChanges {
    /// Those that stand elsewhere now: id to metres.
    moved: BTreeMap<u64, f64>,
    /// Those that are one with another now: id to that other; the id leads there.
    merged: BTreeMap<u64, u64>,
    /// Those of which a part has become another, and that other.
    split: Vec<(u64, u64)>,
    /// Those that are there no more.
    vanished: Vec<u64>,
    /// Those that were not there before.
    appeared: Vec<u64>,
}

impl PyThingChanges {
    fn of<Id: Numbered>(changes: &ThingChanges<Id>) -> Self {
        let numbers = |ids: &[Id]| ids.iter().map(|id| id.number()).collect();
        Self {
            moved: changes.moved.iter().map(|motion| (motion.id.number(), motion.distance)).collect(),
            merged: changes.merged.iter().map(|(id, into)| (id.number(), into.number())).collect(),
            split: changes.split.iter().map(|(id, into)| (id.number(), into.number())).collect(),
            vanished: numbers(&changes.vanished),
            appeared: numbers(&changes.appeared),
        }
    }
}

/// What a place recognition has found: how the frame `to_frame` was seen from `from_frame`. It may be wrong.
/// `from_from_to` takes points of the one's camera to that of the other; standard deviations about and along each axis
/// in radians and metres.
#[pyclass(frozen, name = "LoopClosure", module = "dymlm")]
#[derive(Debug, Clone, Copy)]
pub(crate) struct PyLoopClosure(pub(crate) LoopClosure);

#[pymethods]
impl PyLoopClosure {
    #[new]
    fn new(
        from_frame: u64,
        to_frame: u64,
        from_from_to: PoseArgument,
        rotation_deviation: f64,
        translation_deviation: f64,
    ) -> Self {
        Self(LoopClosure {
            from: FrameId::new(from_frame),
            to: FrameId::new(to_frame),
            from_from_to: from_from_to.0,
            rotation_deviation,
            translation_deviation,
        })
    }
}

/// What refining the poses has done.
#[pyclass(frozen, get_all, name = "RefineReport", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyRefineReport {
    /// Planes that more than one key frame has seen, in the last round.
    planes: usize,
    /// Views of planes.
    views: usize,
    /// Of these, those that were left out: they are of another plane than the map has them.
    views_left_out: usize,
    /// Pairs of planes of the map that turned out to be one, which was met again, in the last round.
    met_again: usize,
    /// Half the sum of squared errors, in standard deviations, of each round: before and after.
    costs: Vec<[f64; 2]>,
    /// Loop closures that were left out as wrong, by their places in the list.
    left_out: Vec<usize>,
    /// What has become of the maps, a CorrectionReport of the last round.
    correction: PyCorrectionReport,
}

impl PyRefineReport {
    pub(crate) fn of(report: RefineReport) -> Self {
        Self {
            planes: report.found.planes,
            views: report.found.views,
            views_left_out: report.found.views_left_out,
            met_again: report.found.met_again,
            costs: report.costs,
            left_out: report.found.left_out,
            correction: PyCorrectionReport::of(&report.correction),
        }
    }
}

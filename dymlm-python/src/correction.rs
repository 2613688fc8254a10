//! Reports of pose corrections.

use std::collections::BTreeMap;

use dymlm::core::{FrameId, Numbered};
use dymlm::{CorrectionReport, LoopClosure, MotionKind, RefineReport, ThingChanges, UnheldMotion};
use pyo3::prelude::*;

use crate::pose::{PoseArgument, PyPose};

/// What a correction of poses has done.
#[pyclass(frozen, get_all, name = "CorrectionReport", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyCorrectionReport {
    /// Key frames and scans in the maps.
    key_frames: usize,
    /// Key frames and scans whose pose has changed.
    moved_key_frames: usize,
    /// Upper bound of how far a reading has moved, metres.
    largest_motion: f64,
    /// How the newest frame, and so what goes on from it, has moved: a Pose, the identity when it stayed.
    new_from_old: PyPose,
    /// How the planes changed, a ThingChanges.
    planes: PyThingChanges,
    /// How the objects changed, a ThingChanges.
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
            new_from_old: PyPose(report.new_from_old),
            planes: PyThingChanges::of(&report.planes),
            objects: PyThingChanges::of(&report.objects),
        }
    }
}

/// How planes or objects changed, by their ids.
#[pyclass(frozen, get_all, name = "ThingChanges", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyThingChanges {
    /// Ids that have moved, each with the distance in metres.
    moved: BTreeMap<u64, f64>,
    /// Ids that were merged away, each with the id that it was merged into and now leads to.
    merged: BTreeMap<u64, u64>,
    /// Ids that were split, each with the id of the part split off.
    split: Vec<(u64, u64)>,
    /// Ids that do not exist any more.
    vanished: Vec<u64>,
    /// Ids that are new.
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

/// A result of place recognition: the pose of frame `to_frame` relative to `from_frame`. It may be wrong.
/// `from_from_to` takes points from the camera of `to_frame` to that of `from_frame`; the standard deviations
/// are about and along each axis, in radians and metres.
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
    /// Number of views of planes by key frames.
    views: usize,
    /// Number of these views that were rejected: they show another plane than the map assigned.
    views_left_out: usize,
    /// Pairs of planes of the map that turned out to be the same plane, seen again on a revisit, in the last
    /// round.
    met_again: usize,
    /// Times that a plane of the map turned out to be two, since drift had put another in its place.
    parted: usize,
    /// Cost of each round, before and after: half the sum of squared errors in standard deviations.
    costs: Vec<[f64; 2]>,
    /// Indices of the loop closures that were rejected as wrong.
    left_out: Vec<usize>,
    /// Motions that only odometry determines, as along a corridor: (frame id, "translation" or "rotation",
    /// axis (3) in the world, standard deviation in metres or radians), at up to 32 key frames. In these the
    /// poses are as good as those given.
    unheld: Vec<(u64, &'static str, [f64; 3], f64)>,
    /// How the maps changed, one CorrectionReport for all rounds.
    correction: PyCorrectionReport,
}

impl PyRefineReport {
    pub(crate) fn of(report: RefineReport) -> Self {
        Self {
            planes: report.found.planes,
            views: report.found.views,
            views_left_out: report.found.views_left_out,
            met_again: report.found.met_again,
            parted: report.found.parted,
            costs: report.costs,
            left_out: report.found.left_out,
            unheld: report.found.unheld.iter().map(unheld).collect(),
            correction: PyCorrectionReport::of(&report.correction),
        }
    }
}

fn unheld(motion: &UnheldMotion) -> (u64, &'static str, [f64; 3], f64) {
    let kind = match motion.kind {
        MotionKind::Translation => "translation",
        MotionKind::Rotation => "rotation",
    };
    (motion.frame.get(), kind, motion.axis, motion.deviation)
}

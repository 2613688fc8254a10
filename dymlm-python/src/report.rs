//! What frames have done.

use std::collections::BTreeMap;

use dymlm::dynamics::Mover;
use dymlm::{FrameOutcome, FrameReport, MapUpdate, Stage};
use pyo3::prelude::*;

use crate::correction::PyCorrectionReport;

/// What one frame has done: who moved in it, what was masked, what came into the maps.
#[pyclass(frozen, get_all, name = "FrameReport", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFrameReport {
    /// The frame's id, by which it is named from now on.
    id: u64,
    /// Its time, seconds.
    timestamp: f64,
    /// What became of it: "waiting" (for detections), "tracked" (no key frame), "mapped" (a key frame), "scanned" (a
    /// scan), or "mended" (mapped again when its detections came).
    outcome: &'static str,
    /// Who and what may move in it: a list of Mover, by ascending track id.
    movers: Vec<PyMover>,
    /// Pixels that were masked as moving.
    masked_pixels: usize,
    /// Seconds that each step took, by name, and "total".
    stages: BTreeMap<&'static str, f64>,
    /// Reports of the other frames that the call has processed: they had waited for detections.
    released: Vec<Py<PyFrameReport>>,
    /// What came into the maps, a MapUpdate; None when it was not "mapped".
    update: Option<PyMapUpdate>,
    /// What the mending has done, a CorrectionReport; None when it was not "mended".
    correction: Option<PyCorrectionReport>,
}

#[pymethods]
impl PyFrameReport {
    fn __repr__(&self) -> String {
        format!("<dymlm.FrameReport {}: {}, {} movers>", self.id, self.outcome, self.movers.len())
    }
}

impl PyFrameReport {
    pub(crate) fn of(py: Python<'_>, report: FrameReport) -> PyResult<Self> {
        let stages = Stage::ALL.iter().map(|&stage| (stage.name(), report.stages.of(stage).as_secs_f64()));
        let stages = stages.chain([("total", report.stages.total().as_secs_f64())]).collect();
        let (outcome, correction) = match &report.outcome {
            FrameOutcome::Waiting => ("waiting", None),
            FrameOutcome::Tracked => ("tracked", None),
            FrameOutcome::Mapped(_) => ("mapped", None),
            FrameOutcome::Scanned(_) => ("scanned", None),
            FrameOutcome::Mended(correction) => ("mended", Some(PyCorrectionReport::of(correction))),
            _ => ("", None),
        };
        Ok(Self {
            id: report.id.get(),
            timestamp: report.timestamp,
            outcome,
            movers: report.movers.iter().map(PyMover::of).collect(),
            masked_pixels: report.masked_pixels,
            stages,
            update: report.update().map(PyMapUpdate::of),
            correction,
            released: Self::of_all(py, report.released)?,
        })
    }

    pub(crate) fn of_all(py: Python<'_>, reports: Vec<FrameReport>) -> PyResult<Vec<Py<Self>>> {
        reports.into_iter().map(|report| Py::new(py, Self::of(py, report)?)).collect()
    }
}

/// Somebody or something in a frame that may move.
#[pyclass(frozen, get_all, name = "Mover", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyMover {
    /// Its track: the same from frame to frame.
    track_id: u64,
    /// What it is; None for what no detector reports.
    label: Option<String>,
    /// The detector's confidence, 0 to 1; 1 without a label.
    score: f32,
    /// The box that holds its pixels: x_min, y_min, x_max, y_max.
    r#box: [f32; 4],
    /// The box as it was detected, or predicted.
    detected_box: [f32; 4],
    /// Median depth, metres; None when nothing of it was read.
    depth: Option<f32>,
}

#[pymethods]
impl PyMover {
    fn __repr__(&self) -> String {
        format!("<dymlm.Mover {}: {:?}, box {:?}>", self.track_id, self.label, self.r#box)
    }
}

impl PyMover {
    fn of(mover: &Mover) -> Self {
        Self {
            track_id: mover.track_id.get(),
            label: mover.label.as_deref().map(str::to_owned),
            score: mover.score,
            r#box: mover.corrected_box.into(),
            detected_box: mover.bounding_box.into(),
            depth: mover.depth,
        }
    }
}

/// What a key frame has brought into the maps. Planes and objects by their ids.
#[pyclass(frozen, get_all, name = "MapUpdate", module = "dymlm")]
#[derive(Debug, Clone)]
pub(crate) struct PyMapUpdate {
    /// Static readings in range.
    readings: usize,
    /// Voxels of the cloud that were empty before.
    new_voxels: usize,
    /// Cells of the octree that were hit.
    hit_cells: usize,
    /// Cells that rays passed.
    missed_cells: usize,
    /// Planes that are new.
    planes_created: Vec<u64>,
    /// Planes that were seen again.
    planes_updated: Vec<u64>,
    /// Planes that proved to be one: which has gone into which.
    planes_merged: Vec<(u64, u64)>,
    /// Objects that are new; tentative until they are seen again.
    objects_created: Vec<u64>,
    /// Objects that got new parameters.
    objects_updated: Vec<u64>,
    /// Objects that are part of the map from now on.
    objects_confirmed: Vec<u64>,
    /// Objects that proved to be one: which has gone into which.
    objects_merged: Vec<(u64, u64)>,
    /// Objects that are not there.
    objects_removed: Vec<u64>,
}

impl PyMapUpdate {
    fn of(update: &MapUpdate) -> Self {
        let MapUpdate { cloud, octree, planes, objects, .. } = update;
        let of_planes = |ids: &[dymlm::core::PlaneId]| ids.iter().map(|id| id.get()).collect();
        let of_objects = |ids: &[dymlm::core::ObjectId]| ids.iter().map(|id| id.get()).collect();
        Self {
            readings: cloud.readings,
            new_voxels: cloud.new_voxels,
            hit_cells: octree.hit_cells,
            missed_cells: octree.missed_cells,
            planes_created: of_planes(&planes.created),
            planes_updated: of_planes(&planes.updated),
            planes_merged: planes.merged.iter().map(|merge| (merge.from.get(), merge.into.get())).collect(),
            objects_created: of_objects(&objects.created),
            objects_updated: of_objects(&objects.updated),
            objects_confirmed: of_objects(&objects.confirmed),
            objects_merged: objects.merged.iter().map(|one| (one.removed.get(), one.kept.get())).collect(),
            objects_removed: of_objects(&objects.removed),
        }
    }
}

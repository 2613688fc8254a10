//! Reports of frames.

use std::collections::BTreeMap;

use dymlm::cloud::CloudFrameReport;
use dymlm::core::{ObjectId, PlaneId};
use dymlm::dynamics::Mover;
use dymlm::octree::InsertReport;
use dymlm::{FrameOutcome, FrameReport, MapUpdate, ScanUpdate, Stage};
use pyo3::prelude::*;

use crate::correction::PyCorrectionReport;

/// The result of one frame: its movers, its masked pixels, and what it added to the maps.
#[pyclass(frozen, get_all, name = "FrameReport", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFrameReport {
    /// The frame's id.
    id: u64,
    /// Its time, seconds.
    timestamp: f64,
    /// What became of it: "waiting" (for detections), "tracked" (no key frame), "mapped" (a key frame),
    /// "scanned" (a scan), or "mended" (mapped again when its detections came).
    outcome: &'static str,
    /// The movers in it, a list of Mover by ascending track id.
    movers: Vec<PyMover>,
    /// Number of pixels that were masked as moving.
    masked_pixels: usize,
    /// Seconds that each step took, by name, and "total" for the whole insertion.
    stages: BTreeMap<&'static str, f64>,
    /// Reports of other frames that had waited for detections and were processed in this call.
    released: Vec<Py<PyFrameReport>>,
    /// What was added to the maps, a MapUpdate; None when the frame was neither "mapped" nor "scanned".
    update: Option<PyMapUpdate>,
    /// How the maps changed, a CorrectionReport; None when the frame was not "mended".
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
        let of_frame = report.update().map(PyMapUpdate::of);
        Ok(Self {
            id: report.id.get(),
            timestamp: report.timestamp,
            outcome,
            movers: report.movers.iter().map(PyMover::of).collect(),
            masked_pixels: report.masked_pixels,
            stages,
            update: of_frame.or_else(|| report.scan().map(PyMapUpdate::of_scan)),
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
    /// Id of its track, the same from frame to frame.
    track_id: u64,
    /// Its label; None for an unlabelled mover, which no detector reports.
    label: Option<String>,
    /// The detector's confidence, 0 to 1; 1 for an unlabelled mover.
    score: f32,
    /// The box that holds its pixels: x_min, y_min, x_max, y_max.
    r#box: [f32; 4],
    /// The detected or predicted box.
    detected_box: [f32; 4],
    /// Median depth, metres; None without readings.
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

/// What a key frame or a scan has added to the maps. Planes and objects are given by their ids; a scan adds to
/// cloud and octree, and updates or removes objects where it sees free space.
#[pyclass(frozen, get_all, name = "MapUpdate", module = "dymlm")]
#[derive(Debug, Clone, Default)]
pub(crate) struct PyMapUpdate {
    /// Number of static readings in range.
    readings: usize,
    /// Number of voxels of the cloud that were empty before.
    new_voxels: usize,
    /// Number of cells of the octree that were hit.
    hit_cells: usize,
    /// Number of cells of the octree that rays passed through.
    missed_cells: usize,
    /// Planes that are new.
    planes_created: Vec<u64>,
    /// Planes that were seen again.
    planes_updated: Vec<u64>,
    /// Planes that were merged: a list of (merged id, remaining id).
    planes_merged: Vec<(u64, u64)>,
    /// New candidates for objects, not confirmed until they are seen again.
    objects_created: Vec<u64>,
    /// Objects that got new parameters.
    objects_updated: Vec<u64>,
    /// Objects that were confirmed: they are part of the map from now on.
    objects_confirmed: Vec<u64>,
    /// Objects that were merged: a list of (merged id, remaining id).
    objects_merged: Vec<(u64, u64)>,
    /// Objects that were removed, since they are not there.
    objects_removed: Vec<u64>,
}

impl PyMapUpdate {
    fn of(update: &MapUpdate) -> Self {
        let MapUpdate { cloud, octree, planes, objects, .. } = update;
        let of_planes = |ids: &[PlaneId]| ids.iter().map(|id| id.get()).collect();
        Self {
            planes_created: of_planes(&planes.created),
            planes_updated: of_planes(&planes.updated),
            planes_merged: planes.merged.iter().map(|merge| (merge.from.get(), merge.into.get())).collect(),
            objects_created: of_objects(&objects.created),
            objects_updated: of_objects(&objects.updated),
            objects_confirmed: of_objects(&objects.confirmed),
            objects_merged: objects.merged.iter().map(|one| (one.removed.get(), one.kept.get())).collect(),
            objects_removed: of_objects(&objects.removed),
            ..Self::of_space(cloud, octree)
        }
    }

    fn of_scan(update: &ScanUpdate) -> Self {
        let ScanUpdate { cloud, octree, removed, updated, .. } = update;
        let (objects_updated, objects_removed) = (of_objects(updated), of_objects(removed));
        Self { objects_updated, objects_removed, ..Self::of_space(cloud, octree) }
    }

    /// What has come into cloud and octree.
    fn of_space(cloud: &CloudFrameReport, octree: &InsertReport) -> Self {
        Self {
            readings: cloud.readings,
            new_voxels: cloud.new_voxels,
            hit_cells: octree.hit_cells,
            missed_cells: octree.missed_cells,
            ..Self::default()
        }
    }
}

fn of_objects(ids: &[ObjectId]) -> Vec<u64> {
    ids.iter().map(|id| id.get()).collect()
}

use std::collections::BTreeMap;

use dymlm::core::{BoundingBox, Detection, FrameId, Pose, SensorModel};
use dymlm::dynamics::Mover;
use dymlm::{Detections, FrameReport, HistoryConfig, MapBuilder, MultiLevelMap, RefineConfig, Stage};
use dymlm_examples::{AnyError, insertion_time, step_time};
use dymlm_metrics::{IdentifiedBox, MaskScore, TrackingScorer, TrajectoryScore};
use dymlm_sim::{SimulatedFrame, VisibleThing};

use crate::columns::Scores;
use crate::drift::Poses;
use crate::treatment::{Detector, Treatment};

/// A builder with the figures that are gathered while it runs.
pub(crate) struct Run {
    treatment: Treatment,
    detector: Detector,
    min_score: f32,
    stride: usize,
    frames: usize,
    builder: MapBuilder,
    masks: MaskScore,
    boxes: TrackingScorer,
    /// For each thing, by its id, the number of frames in which a detection of it reached the builder.
    detected: BTreeMap<usize, u32>,
    reports: Vec<FrameReport>,
    poses: Poses,
    /// The true poses of the frames.
    true_poses: Vec<(FrameId, Pose)>,
}

/// Share of the image below which a view of a mover is a sliver, which need not be found and may be: 5000
/// pixels of 640x480, as in the figures of detectors.
const SLIVER: f64 = 5000.0 / (640.0 * 480.0);

/// The label of those movers that a detector reports.
const PERSON: &str = "person";

/// Least intersection over union of a detection with a thing's exact box.
const DETECTED: f64 = 0.5;

/// Whether a detection reports a thing.
fn is_detected(thing: &VisibleThing, detections: &[Detection]) -> bool {
    detections.iter().any(|detection| {
        detection.label() == thing.label && detection.bounding_box().iou(&thing.bounding_box) >= DETECTED
    })
}

/// The steps that are timed, by column.
const STEPS: &[(&str, Stage)] = &[
    ("speed.dynamics", Stage::Dynamics),
    ("speed.cloud", Stage::Cloud),
    ("speed.octree", Stage::Octree),
    ("speed.plane_detection", Stage::PlaneDetection),
    ("speed.plane_map", Stage::PlaneMap),
    ("speed.objects", Stage::Objects),
];

impl Run {
    pub(crate) fn new(
        treatment: Treatment,
        detector: Detector,
        min_score: f32,
        sensor: SensorModel,
        poses: Poses,
    ) -> Result<Self, AnyError> {
        let mut config = treatment.config();
        config.sensor = sensor;
        if matches!(poses, Poses::Corrected | Poses::Refined) {
            config.history = HistoryConfig::Memory;
        }
        Ok(Self {
            treatment,
            detector,
            min_score,
            stride: sensor.stride,
            frames: 0,
            builder: MapBuilder::new(config)?,
            masks: MaskScore::default(),
            boxes: TrackingScorer::new(),
            detected: BTreeMap::new(),
            reports: Vec::new(),
            poses,
            true_poses: Vec::new(),
        })
    }

    pub(crate) fn treatment(&self) -> Treatment {
        self.treatment
    }

    pub(crate) fn detector(&self) -> Detector {
        self.detector
    }

    pub(crate) fn map(&self) -> &MultiLevelMap {
        self.builder.map()
    }

    pub(crate) fn poses(&self) -> Poses {
        self.poses
    }

    /// For each thing, by its id, the number of frames in which a detection of it reached the builder.
    pub(crate) fn detected(&self) -> &BTreeMap<usize, u32> {
        &self.detected
    }

    /// Brings all maps up to date after the last frame.
    pub(crate) fn finish(&mut self) {
        self.builder.settle();
    }

    /// Corrects the maps to the true poses, or refines the poses.
    pub(crate) fn correct(&mut self) -> Result<(), AnyError> {
        if self.poses == Poses::Refined {
            self.builder.refine_poses(&RefineConfig::default())?;
        } else {
            self.builder.correct_poses(&self.true_poses)?;
        }
        Ok(())
    }

    /// Inserts a frame at its pose, which may drift.
    pub(crate) fn insert(&mut self, frame: &SimulatedFrame, drifting: &Pose) -> Result<(), AnyError> {
        let mut detections = frame.detections.clone();
        detections.retain(|detection| detection.score() >= self.min_score);
        let runs = self.treatment != Treatment::NoDetections && self.detector.runs(self.frames);
        let found = runs.then_some(detections.as_slice());
        self.frames += 1;
        let pose = if self.poses == Poses::True { &frame.world_from_camera } else { drifting };
        let report = self.builder.insert(&frame.frame, Detections::from(found), pose)?;
        let given = found.unwrap_or_default();
        for thing in frame.visible_things.iter().filter(|thing| is_detected(thing, given)) {
            *self.detected.entry(thing.id).or_default() += 1;
        }
        self.true_poses.push((report.id, frame.world_from_camera));
        let masked = self.builder.preprocessor().static_mask().inverted();
        if masked.width() == frame.mover_mask.width() {
            self.masks.add(&masked, &frame.mover_mask, frame.frame.depth())?;
        } else {
            let mut movers = frame.mover_mask.clone();
            movers.subsample_from(&frame.mover_mask, self.stride);
            self.masks.add(&masked, &movers, frame.frame.subsampled(self.stride)?.depth())?;
        }
        if self.treatment != Treatment::NoDetections {
            self.count_boxes(frame, &report, found)?;
        }
        self.reports.push(report);
        Ok(())
    }

    /// Scores the tracked boxes of people; `given`: the detections that reached the builder, if the
    /// detector ran. Movers without a label, which are found by geometry, are scored by the mask: they may
    /// be anything.
    fn count_boxes(
        &mut self,
        frame: &SimulatedFrame,
        report: &FrameReport,
        given: Option<&[Detection]>,
    ) -> Result<(), AnyError> {
        let pixels = (frame.mover_mask.width() * frame.mover_mask.height()) as f64;
        let is_sliver = |thing: &&VisibleThing| (thing.pixels as f64) < SLIVER * pixels;
        let movers = frame.visible_things.iter().filter(|thing| thing.moves && thing.label == PERSON);
        let (slivers, whole): (Vec<&VisibleThing>, Vec<_>) = movers.partition(is_sliver);
        let slivers: Vec<BoundingBox> = slivers.iter().map(|thing| thing.bounding_box).collect();
        let identified =
            |thing: &&VisibleThing| IdentifiedBox { id: thing.id as u64, bounding_box: thing.bounding_box };
        let truth: Vec<IdentifiedBox> = whole.iter().map(identified).collect();
        let output =
            |mover: &Mover| IdentifiedBox { id: mover.track_id.get(), bounding_box: mover.bounding_box };
        let labelled = report.movers.iter().filter(|mover| mover.label.is_some());
        let output: Vec<IdentifiedBox> = labelled.map(output).collect();
        let people = |given: &[Detection]| -> Vec<BoundingBox> {
            let people = given.iter().filter(|detection| detection.label() == PERSON);
            people.map(Detection::bounding_box).collect()
        };
        let found = given.map(people);
        Ok(self.boxes.add_frame_ignoring(&slivers, &truth, &output, found.as_deref())?)
    }

    /// The figures that do not concern a map: masks, boxes, times.
    pub(crate) fn score(&self, scores: &mut Scores) {
        scores.set("mask.recall", self.masks.recall());
        scores.set("mask.precision", self.masks.precision());
        if self.treatment != Treatment::NoDetections {
            let boxes = self.boxes.score();
            scores.set("boxes.misses", boxes.missed_detections as f64);
            scores.set("boxes.recovered", boxes.misses_recovered);
            scores.set("boxes.mota", boxes.mota);
            scores.set("boxes.idf1", boxes.idf1);
        }
        self.score_trajectory(scores);
        self.score_speed(scores);
    }

    /// Scores the trajectory, if its poses were not the true ones and can be queried.
    fn score_trajectory(&self, scores: &mut Scores) {
        let mapped: Vec<Pose> = self.builder.trajectory().map(|(_, _, pose)| pose).collect();
        let truth: Vec<Pose> = self.true_poses.iter().map(|(_, pose)| *pose).collect();
        if self.poses == Poses::True || mapped.len() != truth.len() {
            return;
        }
        if let Some(score) = TrajectoryScore::of(&mapped, &truth) {
            scores.set("trajectory.translation", score.translation);
            scores.set("trajectory.rotation", score.rotation);
        }
    }

    fn score_speed(&self, scores: &mut Scores) {
        for &(key, stage) in STEPS {
            scores.set(key, step_time(&self.reports, stage).median_ms / 1e3);
        }
        let insert = insertion_time(&self.reports);
        scores.set("speed.insert", insert.median_ms / 1e3);
        scores.set("speed.insert_p95", insert.p95_ms / 1e3);
    }
}

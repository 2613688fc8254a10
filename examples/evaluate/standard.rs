use std::collections::BTreeMap;

use dymlm::core::{DepthImage, Frame, Point, PointCloud};
use dymlm::files::plane_records;
use dymlm::octree::CellState;
use dymlm::{ObjectMap, Octree, PlaneMap};
use dymlm_examples::AnyError;
use dymlm_metrics::{
    Demand, DynamicMapScorer, EstimatedObject, EstimatedPlane, ObjectScore, Occupancy, OccupancyScorer,
    OccupiedCell, SpaceTruth, score_cloud, score_objects, score_planes, score_walls,
};
use dymlm_sim::{Sequence, SimulatedFrame, Truth, TruthConfig};

use crate::columns::Scores;

/// The truth that the maps of one sequence are scored against.
pub(crate) struct Standard {
    truth: Truth,
    dynamic_map: DynamicMapScorer,
    occupancy: OccupancyScorer,
    has_undetected: bool,
}

/// The truth about the traces of only those movers that no detector reports.
struct Undetected<'a>(&'a Truth);

impl SpaceTruth for Undetected<'_> {
    fn surface_distance(&self, point: Point) -> f32 {
        self.0.surface_distance(point)
    }

    fn swept_by_movers(&self, point: Point) -> bool {
        self.0.swept_by_undetected(point)
    }

    fn was_looked_through(&self, point: Point) -> bool {
        self.0.was_looked_through(point)
    }

    fn visible_points(&self) -> Vec<Point> {
        Vec::new()
    }
}

/// Depths at which readings are scored, metres.
const RANGE: std::ops::RangeInclusive<f32> = 0.5..=4.0;

/// Frames in which a thing must be detected to be mapped: with fewer, the map never confirms it.
const LEAST_DETECTIONS: u32 = 3;

/// The frame with those readings whose true depth is scored. A reading of 3.98 m of a wall at 4.05 m errs; a map
/// is not asked for it.
fn truly_in_range(frame: &SimulatedFrame) -> Result<Frame, AnyError> {
    let (depth, truth) = (frame.frame.depth(), frame.true_depth.data());
    let readings = depth.data().iter().zip(truth);
    let in_range = readings.map(|(&z, truth)| if RANGE.contains(truth) { z } else { 0.0 }).collect();
    let depth = DepthImage::new(depth.width(), depth.height(), in_range)?;
    Ok(Frame::new(frame.frame.timestamp(), *frame.frame.camera(), depth, None)?)
}

impl Standard {
    pub(crate) fn new(sequence: &Sequence) -> Result<Self, AnyError> {
        Ok(Self {
            truth: Truth::new(sequence, &TruthConfig::default())?,
            dynamic_map: DynamicMapScorer::new(RANGE),
            occupancy: OccupancyScorer::new(RANGE),
            has_undetected: !sequence.config().events.is_empty()
                || sequence.config().detector.overlooked_people > 0,
        })
    }

    /// Adds what a frame shows to the truth.
    pub(crate) fn observe(&mut self, frame: &SimulatedFrame) -> Result<(), AnyError> {
        self.truth.observe(frame);
        let (transient, pose) = (&frame.transient_mask, &frame.world_from_camera);
        self.occupancy.observe(&frame.frame, &frame.true_depth, transient, pose)?;
        Ok(self.dynamic_map.add_frame(&truly_in_range(frame)?, transient, pose)?)
    }

    pub(crate) fn truth(&self) -> &Truth {
        &self.truth
    }

    pub(crate) fn score_cloud(&self, cloud: &PointCloud, scores: &mut Scores) {
        if let Some(score) = score_cloud(cloud, &self.truth) {
            scores.set("cloud.residue", score.residue);
            scores.set("cloud.seen_residue", score.residue - score.unseen_residue);
            scores.set("cloud.stray", score.stray);
            scores.set("cloud.completeness", score.completeness);
            scores.set("cloud.completeness_near_people", score.completeness_near_people);
            scores.set("cloud.completeness_of_thin_things", score.completeness_of_thin_things);
            scores.set("cloud.median", score.median_distance);
            scores.set("cloud.p95", score.p95_distance);
        } else {
            // An empty cloud covers nothing; without this, it would not count in a mean.
            scores.set("cloud.completeness", 0.0);
        }
        if let Some(score) = score_walls(cloud, &self.truth.faces(), &self.truth) {
            scores.set("cloud.wall_thickness", score.thickness.median);
            scores.set("cloud.wall_thickness_p95", score.thickness.p95);
        }
        if self.has_undetected
            && let Some(score) = score_cloud(cloud, &Undetected(&self.truth))
        {
            scores.set("cloud.undetected_residue", score.residue);
        }
        let score = self.dynamic_map.score(cloud.points());
        scores.set("cloud.static_accuracy", score.static_accuracy);
        scores.set("cloud.dynamic_accuracy", score.dynamic_accuracy);
        scores.set("cloud.associated_accuracy", score.associated_accuracy);
        scores.set("cloud.harmonic_accuracy", score.harmonic_accuracy);
    }

    pub(crate) fn score_planes(&self, planes: &PlaneMap, scores: &mut Scores) {
        let estimates: Vec<EstimatedPlane> = plane_records(planes)
            .into_iter()
            .map(|plane| EstimatedPlane { normal: plane.normal, d: plane.d, boundary: plane.boundary })
            .collect();
        let score = score_planes(&estimates, &self.truth.faces());
        scores.set("planes.faces", score.faces.len() as f64);
        scores.set("planes.recall", score.recall());
        scores.set("planes.precision", score.precision());
        scores.set("planes.duplicates", score.duplicates.len() as f64);
        scores.set("planes.merged", score.wrongly_merged.len() as f64);
        scores.set("planes.angle", score.angle_degrees.map(|angle| angle.median.to_radians()));
        scores.set("planes.offset", score.offset.map(|offset| offset.median));
        scores.set("planes.boundary_iou", score.mean_boundary_iou());
    }

    /// `detected`: for each thing, by its id, the number of frames in which a detection of it reached the
    /// map.
    pub(crate) fn score_objects(
        &self,
        objects: &ObjectMap,
        detected: &BTreeMap<usize, u32>,
        scores: &mut Scores,
    ) {
        let estimates: Vec<EstimatedObject> = objects
            .objects()
            .map(|object| EstimatedObject {
                label: object.label().to_owned(),
                world_from_object: object.oriented_box().world_from_box(),
                dimensions: object.oriented_box().lengths(),
            })
            .collect();
        let score = score_objects(&estimates, &self.truth.objects());
        scores.set("objects.objects", score.asked as f64);
        scores.set("objects.recall", score.recall());
        scores.set("objects.recall_of_detected", recall_of_detected(&score, detected));
        scores.set("objects.precision", score.precision());
        scores.set("objects.duplicates", score.duplicates.len() as f64);
        scores.set("objects.iou", score.mean_iou);
        scores.set("objects.center", score.center_error.map(|error| error.median));
        scores.set("objects.yaw", score.yaw_error_degrees.map(|error| error.median.to_radians()));
        scores.set("objects.labels", score.label_accuracy());
    }

    pub(crate) fn score_octree(&self, octree: &Octree, scores: &mut Scores) -> Result<(), AnyError> {
        let leaves = octree.leaves().filter(|leaf| leaf.state == CellState::Occupied);
        let occupied: Vec<OccupiedCell> =
            leaves.map(|leaf| OccupiedCell { center: leaf.center, size: leaf.size }).collect();
        let occupancy_at = |point: Point| match octree.state(point.map(f64::from)) {
            CellState::Occupied => Occupancy::Occupied,
            CellState::Free => Occupancy::Free,
            CellState::Unknown => Occupancy::Unknown,
        };
        let score = self.occupancy.score(&self.truth, octree.resolution(), &occupied, occupancy_at)?;
        if let Some(free_space) = score.free_space {
            scores.set("octree.ghosts", free_space.ghosts);
            scores.set("octree.false_occupied", free_space.false_occupied);
            scores.set("octree.free", free_space.free);
        }
        if let Some(surface) = score.surface {
            scores.set("octree.completeness", surface.completeness);
            scores.set("octree.false_free", surface.false_free);
        }
        if let Some(cells) = score.cells {
            scores.set("octree.median", cells.median_distance);
            scores.set("octree.p95", cells.p95_distance);
            scores.set("octree.residue", cells.residue);
        }
        Ok(())
    }
}

/// Recall among the objects that were detected often enough to be mapped: of the others, a map cannot know.
/// `None` when there are none.
fn recall_of_detected(score: &ObjectScore, detected: &BTreeMap<usize, u32>) -> Option<f64> {
    let was_detected = |id: &usize| detected.get(id).is_some_and(|&frames| frames >= LEAST_DETECTIONS);
    let asked = score.matches.iter().filter(|found| found.demand == Demand::Asked);
    let found = asked.filter(|found| was_detected(&found.object)).count();
    let missed = score.missed.iter().filter(|id| was_detected(id)).count();
    (found + missed > 0).then(|| found as f64 / (found + missed) as f64)
}

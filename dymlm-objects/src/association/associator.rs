use std::collections::BTreeMap;

use dymlm_core::Birth;
use dymlm_core::vector3::Vector3;
use dymlm_geometry::Assignment;

use super::shared_points::{sample_places, shared_share};
use super::{AssociationConfig, CentroidVerdict, joint_iou, visible_iou};
use crate::{MapObject, ObjectMap, ObjectObservation, ObjectState, ObjectView, SizePriors};

/// The integer that stands for an affinity of 1: in fixed point the sums of assignments compare exactly, on
/// every machine.
const ONE: f64 = (1_u64 << 38) as f64;

/// Results of the four tests of a detection and an object; `None` where a test cannot be made. A pair that
/// fails the first test is not tested further.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct AssociationTests {
    /// Intersection over union of the object's projection with the detected box, 0..=1.
    pub projection_iou: f64,
    /// Intersection over union of the box predicted by motion with the detected box, 0..=1.
    pub motion_iou: Option<f64>,
    /// Share of the observation's points that the object has, 0..=1.
    pub shared: Option<f64>,
    /// The test of the centroid.
    pub centroid: Option<CentroidVerdict>,
    /// Intersection over union of the detected box with the projection of the box around both object and
    /// observation, 0..=1. Given only where that box fits the object's earlier views as well as the object's
    /// own box does and is not too large for the label: then the observation shows another side of the
    /// object.
    pub joint_iou: Option<f64>,
}

impl AssociationTests {
    /// Whether the pair passes: projection AND (motion OR shared points OR centroid), OR the box around both.
    fn pass(&self, config: &AssociationConfig) -> bool {
        self.joint_iou.is_some() || self.are_near(config)
    }

    fn are_near(&self, config: &AssociationConfig) -> bool {
        let reaches = |value: f64, least: f64| value >= least && value > 0.0;
        reaches(self.projection_iou, config.min_projection_iou)
            && (self.motion_iou.is_some_and(|iou| reaches(iou, config.min_motion_iou))
                || self.shared.is_some_and(|share| reaches(share, config.min_shared))
                || self.centroid == Some(CentroidVerdict::Accepted))
    }

    /// How well the pair fits: the weighted sum of the tests' values.
    fn affinity(&self) -> f64 {
        self.projection_iou.max(self.joint_iou.unwrap_or(0.0))
            + 0.5 * self.motion_iou.unwrap_or(0.0)
            + self.shared.unwrap_or(0.0)
    }
}

/// Pairs the observations of a frame with the objects of the map.
#[derive(Debug, Clone)]
pub(crate) struct Associator {
    config: AssociationConfig,
    tests: Vec<AssociationTests>,
    /// The test results of each observation with its assigned object.
    chosen: Vec<AssociationTests>,
    affinities: Vec<f64>,
    places: Vec<Vector3>,
    assignment: Assignment,
    /// Limits of the centroid test by number of centroids; `None` where the centroids are too few.
    limits: BTreeMap<u32, Option<f64>>,
    /// Times of the last three runs of the detector, newest first, seconds.
    times: [f64; 3],
}

impl Associator {
    pub(crate) fn new(config: AssociationConfig) -> Self {
        Self {
            config,
            tests: Vec::new(),
            chosen: Vec::new(),
            affinities: Vec::new(),
            places: Vec::new(),
            assignment: Assignment::default(),
            limits: BTreeMap::new(),
            times: [f64::NAN; 3],
        }
    }

    /// Times of the last three runs of the detector, newest first; NaN where there was none.
    #[cfg(feature = "state")]
    pub(crate) fn times(&self) -> [f64; 3] {
        self.times
    }

    /// Restores the times of the last three runs of the detector.
    #[cfg(feature = "state")]
    pub(crate) fn restore_times(&mut self, times: [f64; 3]) {
        self.times = times;
    }

    /// Tests all pairs of an observation and an object `in_view`, and assigns. Returns for each observation
    /// the index of its object in `in_view`.
    pub(crate) fn associate(
        &mut self,
        view: &ObjectView<'_>,
        observations: &[ObjectObservation],
        map: &ObjectMap,
        in_view: &[Birth],
        priors: &SizePriors,
    ) -> &[Option<usize>] {
        self.tests.clear();
        self.affinities.clear();
        self.times = [view.frame.timestamp(), self.times[0], self.times[1]];
        for observation in observations {
            sample_places(observation, &view.world_from_camera, &mut self.places);
            for &birth in in_view {
                let Some(object) = map.born(birth) else { continue };
                let mut tests = self.test(view, observation, object, priors);
                if !tests.are_near(&self.config) && observation.label == object.label {
                    tests.joint_iou = joint_iou(view, observation, &self.places, object, priors);
                }
                let passes = tests.pass(&self.config);
                let cost = if observation.label == object.label { 0.0 } else { self.config.label_cost };
                // A pair that passes has a positive affinity, so that it is preferred to no pair whatever its
                // label costs.
                self.affinities.push(if passes { (tests.affinity() - cost).max(1e-3) } else { 0.0 });
                self.tests.push(tests);
            }
        }
        let Self { affinities, assignment, .. } = self;
        let columns = in_view.len();
        let matches = assignment.solve(observations.len(), columns, |row, column| {
            (affinities[row * columns + column] * ONE).round() as i64
        });
        let tests_of = |(row, column): (usize, &Option<usize>)| {
            column.and_then(|column| self.tests.get(row * columns + column)).copied().unwrap_or_default()
        };
        self.chosen.clear();
        self.chosen.extend(matches.iter().enumerate().map(tests_of));
        matches
    }

    /// The test results of an observation of the last frame with its assigned object.
    pub(crate) fn tests(&self, observation: usize) -> AssociationTests {
        self.chosen.get(observation).copied().unwrap_or_default()
    }

    fn test(
        &mut self,
        view: &ObjectView<'_>,
        observation: &ObjectObservation,
        object: &MapObject,
        priors: &SizePriors,
    ) -> AssociationTests {
        let detected = &observation.bounding_box;
        let camera = view.frame.camera();
        let projected = object.shape().image_box(camera, &view.world_from_camera);
        let projection_iou =
            projected.map_or(0.0, |own| visible_iou(&own, detected, observation.completeness, camera));
        // Most pairs are far apart in the image and cannot pass, so the other tests are skipped.
        if projection_iou < self.config.min_projection_iou || projection_iou <= 0.0 {
            return AssociationTests { projection_iou, ..AssociationTests::default() };
        }
        // The boxes of a slow detector are predicted from run to run, with an allowance for irregular times;
        // a pause of the detector does not widen the gap.
        let [newest, last, before] = self.times;
        let max_gap = self.config.max_motion_gap.max(1.5 * (newest - last).min(last - before));
        let predicted = object.motion.predict(newest, max_gap);
        // Of an object that is hardly known, what is elsewhere may be the thing that the detector means.
        let is_known = object.state == ObjectState::Confirmed;
        let predicted = predicted.filter(|_| is_known || is_in_reach(observation, object, priors));
        AssociationTests {
            projection_iou,
            motion_iou: predicted.map(|own| own.iou(detected)),
            shared: shared_share(observation, &self.places, object),
            centroid: Some(self.centroid_verdict(observation, object)),
            joint_iou: None,
        }
    }

    fn centroid_verdict(&mut self, observation: &ObjectObservation, object: &MapObject) -> CentroidVerdict {
        let (test, cloud) = (self.config.centroid_test, &object.centroids);
        // With more centroids the limit hardly changes.
        let count = cloud.count().min(2000);
        let alpha = self.config.alpha;
        let limit = *self.limits.entry(count).or_insert_with(|| test.limit(count, alpha));
        limit.map_or(CentroidVerdict::Undecided, |limit| test.verdict_at(cloud, observation.centroid, limit))
    }
}

/// Whether an observation is where an object's parts may be. What moves with an object in the image, but is
/// not, was found before or behind it.
fn is_in_reach(observation: &ObjectObservation, object: &MapObject, priors: &SizePriors) -> bool {
    object
        .oriented_box
        .with_rim(priors.reach(&object.label))
        .is_ok_and(|around| around.contains(observation.centroid))
}

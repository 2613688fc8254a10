use dymlm_core::vector3::along;
use dymlm_core::{ConfigError, Plane, Point};
use dymlm_geometry::{IsolationForest, IsolationForestConfig, IsolationForestScratch, IsolationTrees};

use crate::object_map::ObjectCloud;

/// Selects the points of a cloud that belong to the object: they have enough observations, are above the
/// supporting plane, and are no outliers to the isolation forest (paper IV-C).
#[derive(Debug, Clone)]
pub(super) struct OutlierFilter {
    forest: IsolationForest,
    /// Score above which a point is an outlier.
    threshold: f64,
    scratch: IsolationForestScratch<3>,
    trees: IsolationTrees<3>,
    counts: Vec<u32>,
    kept: Vec<Point>,
    scores: Vec<f64>,
}

/// Least points for which a forest is grown.
const MIN_FOREST_VOXELS: usize = 32;

impl OutlierFilter {
    pub(super) fn new(forest: IsolationForestConfig) -> Result<Self, ConfigError> {
        Ok(Self {
            forest: IsolationForest::new(forest)?,
            threshold: forest.threshold,
            scratch: IsolationForestScratch::default(),
            trees: IsolationTrees::default(),
            counts: Vec::new(),
            kept: Vec::new(),
            scores: Vec::new(),
        })
    }

    /// Writes the object's points, relative to the cloud's origin, into `points`. `plane` is the supporting
    /// plane in the same frame; points up to `tolerance` metres above it are the plane's. `share` is the
    /// share of the upper quartile of the voxels' observations that a voxel needs to count, and places for
    /// which `is_excluded` holds (world) are not the object's.
    pub(super) fn choose(
        &mut self,
        cloud: &ObjectCloud,
        plane: Option<&Plane>,
        tolerance: f64,
        share: f64,
        is_excluded: impl Fn([f64; 3]) -> bool,
        points: &mut Vec<Point>,
    ) {
        let least = self.least_observations(cloud, share);
        let is_other = |place: [f64; 3]| is_excluded(along(place, 1.0, cloud.origin()));
        let stands = |place: [f64; 3]| plane.is_none_or(|plane| plane.signed_distance(place) > tolerance);
        points.clear();
        let chosen =
            cloud.points().filter(|&(place, count)| count >= least && stands(place) && !is_other(place));
        points.extend(chosen.map(|(place, _)| place.map(|c| c as f32)));
        if points.len() >= MIN_FOREST_VOXELS {
            self.isolate(points);
        }
    }

    /// Least observations of a voxel that counts, which are a share of the upper quartile of the voxels' own.
    pub(super) fn least_observations(&mut self, cloud: &ObjectCloud, share: f64) -> u32 {
        self.counts.clear();
        self.counts.extend(cloud.points().map(|(_, count)| count));
        let rank = self.counts.len() * 3 / 4;
        if rank >= self.counts.len() {
            return 0;
        }
        let usual = *self.counts.select_nth_unstable(rank).1;
        (share * f64::from(usual)).ceil() as u32
    }

    fn isolate(&mut self, points: &mut Vec<Point>) {
        self.forest.fit_into(points, &mut self.scratch, &mut self.trees);
        self.trees.scores_into(points, &mut self.scores);
        self.kept.clear();
        let inliers = points.iter().zip(&self.scores).filter(|(_, score)| **score <= self.threshold);
        self.kept.extend(inliers.map(|(point, _)| *point));
        std::mem::swap(points, &mut self.kept);
    }
}

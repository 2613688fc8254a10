use dymlm_core::{Pose, Visibility};

use super::fit::Fit;
use super::model::ObjectModel;
use super::scene::Scene;
use super::surface::{SurfaceReadings, observe_surface};
use super::view::{PIXEL_SIGMA, PointMatch};
use super::view_store::ViewStore;
use crate::pose::PosePrior;
use crate::{Error, PoseObservation, PoseRansac, PoseRefiner, RansacConfig, RobustKernel};

/// Least number of points that must agree on a pose.
pub(super) const LEAST_INLIERS: usize = 6;
/// Factor on the sensor's noise for the reading at a point, since errors of neighbouring readings are
/// correlated. With 1, a cup is off by 1.5 mm instead of 0.8.
const LIKE_READINGS: f64 = 2.0;
/// A pose less certain than these standard deviations, radians and metres, is useless. Without this limit and
/// without depth, a tilted keyboard is off by half as much again.
const TELLING: [f64; 2] = [0.15, 0.05];

/// Fits the object's pose to a frame.
#[derive(Debug, Clone)]
pub(super) struct PoseFitter {
    ransac: PoseRansac,
    refiner: PoseRefiner,
    model_sigma: f64,
    observations: Vec<PoseObservation>,
}

impl PoseFitter {
    /// `consensus`: largest distance, in pixels, of a point tracked by flow from the pixel that the pose
    /// predicts.
    pub(super) fn new(consensus: f64, model_sigma: f64) -> Result<Self, Error> {
        let ransac = RansacConfig { max_pixels: consensus, max_distance: 0.03, ..RansacConfig::default() };
        Ok(Self {
            ransac: PoseRansac::new(&ransac)?,
            refiner: PoseRefiner::new(RobustKernel::default())?,
            model_sigma,
            observations: Vec::new(),
        })
    }

    /// The pose that most points agree on: from their positions in space where there is depth, else from
    /// pixels.
    pub(super) fn agree(
        &mut self,
        scene: Scene<'_>,
        matches: &[PointMatch],
        prior: Option<&PosePrior>,
    ) -> Option<Pose> {
        let camera = scene.camera;
        let (mut in_object, mut in_camera) = (Vec::new(), Vec::new());
        for found in matches {
            if let Some(reading) = scene.reading_at(found.pixel) {
                in_object.push(found.position);
                in_camera.push(camera.back_project(found.pixel.map(f64::from), reading));
            }
        }
        let in_space =
            (2 * in_object.len() >= matches.len()).then(|| self.ransac.align(&in_object, &in_camera));
        let consensus = in_space.flatten().or_else(|| {
            let positions: Vec<_> = matches.iter().map(|found| found.position).collect();
            let pixels: Vec<_> = matches.iter().map(|found| found.pixel.map(f64::from)).collect();
            self.ransac.pnp(camera, &positions, &pixels)
        })?;
        // Readings are noisier than pixels: the refinement uses both.
        self.observations.clear();
        for found in matches {
            self.observe(scene, found, &consensus.pose, 4.0);
        }
        let refined = self.refiner.refine_with(camera, &consensus.pose, &self.observations, prior)?;
        Some(refined.camera_from_body)
    }

    /// Finds points of stored views near a coarse pose, and fits the pose to them and to the surface's
    /// readings. `None` when too few points agree, or the pose is too uncertain.
    pub(super) fn fit(
        &mut self,
        scene: Scene<'_>,
        model: &ObjectModel,
        views: &mut ViewStore,
        coarse: &Pose,
        prior: Option<&PosePrior>,
    ) -> Option<Fit> {
        let mut matches = views.find_points(scene, coarse);
        let found = matches.len();
        if found < LEAST_INLIERS {
            return None;
        }
        let mut pose = *coarse;
        let mut covariance = None;
        let mut surface = SurfaceReadings::default();
        // The pose decides which reading belongs to which surface point: the second round uses the better
        // pose.
        for _ in 0..2 {
            self.observations.clear();
            for found in &matches {
                self.observe(scene, found, &pose, 1.0);
            }
            surface = observe_surface(model, scene, &pose, self.model_sigma, &mut self.observations);
            if let Some(refined) = self.refiner.refine_with(scene.camera, &pose, &self.observations, prior) {
                pose = refined.camera_from_body;
                covariance = refined.covariance;
            }
        }

        matches.retain(|found| {
            let expected = scene.camera.project(pose.transform_point(found.position));
            let pixel = found.pixel.map(f64::from);
            let sigma = found.spread.hypot(found.blur.min(1.0) * PIXEL_SIGMA);
            expected.is_some_and(|[u, v]| (u - pixel[0]).hypot(v - pixel[1]) <= 4.0 * sigma)
        });
        let share = matches.len() as f64 / found as f64;
        let is_found = prior.is_none();
        let fit = Fit { camera_from_object: pose, covariance, matches, share, surface, is_found };
        (fit.matches.len() >= LEAST_INLIERS && fit.is_known(TELLING)).then_some(fit)
    }

    /// Adds a point's pixel, and its depth if the reading is near enough to belong to the point.
    fn observe(&mut self, scene: Scene<'_>, found: &PointMatch, pose: &Pose, sigma_factor: f64) {
        let point = found.position;
        let sigma = found.spread.hypot(sigma_factor * found.blur * PIXEL_SIGMA);
        self.observations.push(PoseObservation::Pixel { point, pixel: found.pixel.map(f64::from), sigma });
        let Some(depth) = scene.reading_at(found.pixel) else { return };
        let expected = pose.transform_point(point)[2];
        let tolerance = scene.sensor.tolerance(expected as f32, 2.0 * self.model_sigma);
        if Visibility::of_reading(depth, expected, tolerance) == Visibility::Present {
            let sigma = LIKE_READINGS * scene.sigma(depth);
            self.observations.push(PoseObservation::Depth { point, depth, sigma });
        }
    }
}

use dymlm_core::{Frame, Pose, axial_noise};

use super::super::surface::{SurfaceView, observe_surface};
use super::super::view::{Sight, Sighting, View};
use super::ObjectTracker;
use super::readings::{is_hidden, reading_near};
use crate::pose::PosePrior;

/// Views whose directions differ by less than this, radians, show the same; the older one is nearer to the truth. With
/// depth, which corrects each view as it is taken, and without.
pub(super) const SAME_DIRECTION: [f64; 2] = [0.1, 0.7];
/// Squared number of standard deviations from where its motion leads beyond which a pose is not the object's.
const MOST_UNEXPECTED: f64 = 60.0;
/// A pose less certain than these standard deviations, radians and metres, tells nothing.
const TELLING: [f64; 2] = [0.15, 0.05];

/// A pose that fits what is seen.
#[derive(Debug, Clone)]
pub(in super::super) struct Fit {
    pub(in super::super) camera_from_object: Pose,
    pub(super) covariance: Option<[[f64; 6]; 6]>,
    /// Points that agree.
    pub(in super::super) sightings: Vec<Sighting>,
    pub(super) share: f64,
    pub(super) surface: SurfaceView,
    /// Whether it had to be searched, without regard to its motion.
    pub(super) is_found: bool,
}

impl Fit {
    /// Its standard deviations, radians and metres.
    pub(super) fn sigmas(&self) -> Option<[f64; 2]> {
        let c = self.covariance?;
        Some([0, 3].map(|first| (first..first + 3).map(|i| c[i][i]).sum::<f64>().sqrt()))
    }

    /// Whether it is known to these standard deviations, radians and metres.
    pub(super) fn is_known(&self, [angle, place]: [f64; 2]) -> bool {
        self.sigmas().is_some_and(|sigmas| sigmas[0] <= angle && sigmas[1] <= place)
    }
}

/// A frame's pose, from a coarse one.
impl ObjectTracker {
    /// Finds points of stored views near a pose, and fits the pose to them and to the surface's readings. `None` when
    /// too few agree or the depth says that the object is elsewhere.
    pub(super) fn fit(&mut self, frame: &Frame, coarse: &Pose, prior: Option<&PosePrior>) -> Option<Fit> {
        let sightings = self.sight_views(frame, coarse);
        if sightings.len() < self.config.min_inliers {
            return None;
        }
        let mut pose = *coarse;
        let mut covariance = None;
        let mut surface = SurfaceView::default();
        let mut observations = std::mem::take(&mut self.scratch.observations);
        // Which reading belongs to which point of the surface depends on the pose: a second time with the better one.
        for _ in 0..2 {
            observations.clear();
            for sighting in &sightings {
                self.observe(frame, sighting, &pose, 1.0, &mut observations);
            }
            let (gate, factor) = (self.config.surface_gate, 2.0 * self.config.depth_sigma_factor);
            // The noise of the reading, and the model's.
            let sigma = |depth: f32| (factor * f64::from(axial_noise(depth))).hypot(self.config.model_sigma);
            surface = observe_surface(
                &self.model,
                frame.camera(),
                frame.depth(),
                &pose,
                gate,
                sigma,
                &mut observations,
            );
            if let Some(refined) = self.refiner.refine_with(frame.camera(), &pose, &observations, prior) {
                pose = refined.camera_from_body;
                covariance = refined.covariance;
            }
        }
        self.scratch.observations = observations;

        let found = sightings.len();
        let agrees = |sighting: &Sighting| {
            let seen = frame.camera().project(pose.transform_point(sighting.position));
            let pixel = sighting.pixel.map(f64::from);
            let sigma = sighting.spread.hypot(sighting.blur.min(1.0) * self.config.pixel_sigma);
            seen.is_some_and(|[u, v]| (u - pixel[0]).hypot(v - pixel[1]) <= 4.0 * sigma)
        };
        let sightings: Vec<Sighting> = sightings.into_iter().filter(agrees).collect();
        let share = sightings.len() as f64 / found as f64;
        let places = sightings.iter().map(|sighting| pose.transform_point(sighting.position));
        let seen = SurfaceView::of_places(places, frame.camera(), frame.depth(), self.config.surface_gate);
        let is_absent = 2 * seen.seen < seen.hidden + seen.absent;
        let enough = sightings.len() >= self.config.min_inliers && share >= self.config.min_inlier_share;
        let is_possible = prior.is_none_or(|prior| prior.squared_distance(&pose) <= MOST_UNEXPECTED);
        let fit = Fit {
            camera_from_object: pose,
            covariance,
            sightings,
            share,
            surface,
            is_found: prior.is_none(),
        };
        (enough && !is_absent && is_possible && fit.is_known(TELLING)).then_some(fit)
    }

    /// Looks for the points of the views that saw the object from most nearly the same side.
    fn sight_views(&mut self, frame: &Frame, pose: &Pose) -> Vec<Sighting> {
        let sight = Sight { camera: frame.camera(), pyramid: &self.next, depth: frame.depth() };
        let mut sightings: Vec<Sighting> = Vec::with_capacity(self.config.max_points);
        let mut tried = 0;
        let has_depth = reading_near(frame, pose).is_some();
        for index in views_by_angle(&self.views, pose, SAME_DIRECTION[usize::from(!has_depth)]) {
            let Some(view) = self.views.get(index) else { continue };
            for (i, point) in view.points.iter().enumerate() {
                if tried >= 2 * self.config.max_points || sightings.len() >= self.config.max_points {
                    return sightings;
                }
                if is_hidden(frame, pose, point.position, self.config.surface_gate) {
                    continue;
                }
                tried += 1;
                let found = view.sight([index, i], sight, pose, &mut self.template, self.config.likeness());
                // Two views of one corner tell nothing more than one.
                let is_new = |found: &Sighting| {
                    sightings.iter().all(|other| {
                        (other.pixel[0] - found.pixel[0]).abs().max((other.pixel[1] - found.pixel[1]).abs())
                            > 2.0
                    })
                };
                sightings.extend(found.filter(is_new));
            }
        }
        sightings
    }
}

/// Indices of the views, those nearest in direction first, in steps of `step` radians; older ones first within a step.
pub(super) fn views_by_angle(views: &[View], pose: &Pose, step: f64) -> Vec<usize> {
    let mut order: Vec<(f64, usize)> =
        views.iter().enumerate().map(|(i, view)| ((view.angle_to(pose) / step).floor(), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|(_, i)| i).collect()
}

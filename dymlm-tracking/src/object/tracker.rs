use dymlm_core::vector3::{cross, norm};
use dymlm_core::{BoundingBox, Detection, Frame, PinholeCamera, Pose, axial_noise};
use nalgebra::Vector6;

use super::hiding::Hiding;
use super::motion::Motion;
use super::recovery::{Appearance, Place, Wanted};
use super::state::{ObjectState, RestLimits, RestReport, RestWatch};
use super::surface::{SurfaceView, observe_surface};
use super::view::{Likeness, Sight, Sighting, View, projected_bounds};
use super::{ObjectModel, ObjectTrackerConfig};
use crate::flow::Template;
use crate::pose::{PosePrior, moved};
use crate::{
    CornerDetector, Error, FlowPoint, FlowStatus, ImagePyramid, KcfTracker, OpticalFlow, PoseObservation,
    PoseRansac, PoseRefiner,
};

/// How far outside of the model's bounds a reading may lie to belong to the object, metres.
const MARGIN: f64 = 0.006;
/// Corners needed at the start, and readings that say that it stands.
const LEAST_CORNERS: usize = 6;
/// Points that agree at least before what is seen becomes a view of its own.
const LEAST_FOR_VIEW: usize = 12;
/// The window tracker is asked where the object is only when its peak stands out so far.
const LEAST_PEAK: f32 = 6.0;
/// Points of a view, the strongest corners first, that are searched at a place at which a lost object may be.
const POINTS_SEARCHED: usize = 30;
/// Images are halved so often for a search: by 2, it reaches as far as four times 7 pixels.
const HALVINGS_SEARCHED: usize = 2;
/// Least share of a view's points that are found where, without depth, what is seen becomes a view of its own: else
/// something stands before the object.
const LEAST_SHOWN: f64 = 0.4;
/// Least share of an object's surface in view that the depth shows if it stands.
const LEAST_STANDING: f64 = 0.5;
/// Least correlation of windows in halved images.
const COARSE_CORRELATION: f32 = 0.6;
/// Attitudes tried in a frame beside the last, the views among them, and the turn of the others, radians.
const ATTITUDES_A_FRAME: usize = 2;
const MOST_VIEWS_SEARCHED: usize = 8;
const TURNED: f64 = 0.5;
/// Views whose directions differ by less than this, radians, show the same; the older one is nearer to the truth. With
/// depth, which corrects each view as it is taken, and without.
const SAME_DIRECTION: [f64; 2] = [0.1, 0.7];
/// Squared number of standard deviations from where its motion leads beyond which a pose is not the object's.
const MOST_UNEXPECTED: f64 = 60.0;
/// A pose less certain than these standard deviations, radians and metres, tells nothing.
const TELLING: [f64; 2] = [0.15, 0.05];
/// Without depth a view is taken only of a pose known to these standard deviations, radians and metres.
const SURE: [f64; 2] = [0.03, 0.015];

/// Follows a chosen object that is moved by hand, in six degrees of freedom.
///
/// The paper's application (section V-D). In each frame
/// 1. a correlation filter ([`KcfTracker`]) and the last motion say about where it is;
/// 2. optical flow ([`OpticalFlow`]) takes its points there, and a consensus on their motion - 3D-3D where there is
///    depth, else perspective-n-point ([`PoseRansac`]) - gives a pose;
/// 3. points of stored views, warped to that pose, are found in the image to a fraction of a pixel, and the depth inside
///    the silhouette is compared with the model's surface: a fit to all of it ([`PoseRefiner`]) is the frame's pose. Both
///    are anchored to the object, so errors do not add up from frame to frame;
/// 4. when a new face is seen, a view is stored; when the object stands still, that is reported.
///
/// When no pose is found, the object is searched where detector boxes of its label, size and colour are, where the
/// filter saw it, and where it was last. Without depth readings it works from pixels alone.
///
/// Some 10 ms a frame at 640x480; working memory is kept.
#[derive(Debug, Clone)]
pub struct ObjectTracker {
    config: ObjectTrackerConfig,
    model: ObjectModel,
    label: Option<String>,
    appearance: Option<Appearance>,
    kcf: KcfTracker,
    flow: OpticalFlow,
    corners: CornerDetector,
    ransac: PoseRansac,
    refiner: PoseRefiner,
    views: Vec<View>,
    /// Points of the last frame that agreed on its pose.
    tracks: Vec<Sighting>,
    motion: Motion,
    rest: RestWatch,
    state: ObjectState,
    /// Time of the last frame, and of the last one with a pose.
    time: f64,
    seen: f64,
    /// Frames since then.
    misses: usize,
    /// Counts the frames of a search, so that it goes through all views.
    searches: usize,
    last: ImagePyramid,
    next: ImagePyramid,
    template: Template,
    scratch: Scratch,
}

/// Working memory.
#[derive(Debug, Clone, Default)]
struct Scratch {
    from: Vec<[f32; 2]>,
    guesses: Vec<[f32; 2]>,
    found: Vec<FlowPoint>,
    observations: Vec<PoseObservation>,
}

/// What a frame told about the object.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ObjectUpdate {
    /// What is known of it.
    pub state: ObjectState,
    /// Its pose; where `inliers` is 0, the last one (at rest) or a guess from its motion (occluded or lost).
    pub world_from_object: Pose,
    /// The same in the camera's frame.
    pub camera_from_object: Pose,
    /// Covariance of (rotation about the camera's axes, radians; origin, metres), by rows; `None` when this frame gave
    /// no pose, or one that leaves a direction free.
    pub covariance: Option<[[f64; 6]; 6]>,
    /// Points that agree on the pose.
    pub inliers: usize,
    /// Share of the measured points that agree, times the share of the surface in view that nothing hides; 0..=1.
    pub confidence: f64,
    /// The box of the object's bounds in the image, pixels; parts may lie outside. `None` behind the camera.
    pub bounding_box: Option<BoundingBox>,
    /// Whether it came to rest in this frame, at a new place.
    pub came_to_rest: Option<RestReport>,
}

/// A pose that fits what is seen.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub(super) camera_from_object: Pose,
    covariance: Option<[[f64; 6]; 6]>,
    /// Points that agree.
    pub(super) sightings: Vec<Sighting>,
    share: f64,
    surface: SurfaceView,
    /// Whether it had to be searched, without regard to its motion.
    is_found: bool,
}

impl Fit {
    /// Its standard deviations, radians and metres.
    fn sigmas(&self) -> Option<[f64; 2]> {
        let c = self.covariance?;
        Some([0, 3].map(|first| (first..first + 3).map(|i| c[i][i]).sum::<f64>().sqrt()))
    }

    /// Whether it is known to these standard deviations, radians and metres.
    fn is_known(&self, [angle, place]: [f64; 2]) -> bool {
        self.sigmas().is_some_and(|sigmas| sigmas[0] <= angle && sigmas[1] <= place)
    }
}

impl ObjectTracker {
    /// Chooses an object that stands at `world_from_object` and is in view. `label`: the detector's name for it, for
    /// finding it again.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::NoColor`]; [`Error::TargetSize`] when too little of the object is on the image;
    /// [`Error::NotSeen`] when fewer than six corners are found on it.
    pub fn new(
        frame: &Frame,
        world_from_camera: &Pose,
        model: ObjectModel,
        label: Option<&str>,
        world_from_object: &Pose,
        config: &ObjectTrackerConfig,
    ) -> Result<Self, Error> {
        config.validate()?;
        let color = frame.color().ok_or(Error::NoColor)?;
        let camera_from_object = world_from_camera.inverse() * *world_from_object;
        let mut next = ImagePyramid::empty(config.flow.halvings);
        next.build_from_color(color);
        let sight = Sight { camera: frame.camera(), pyramid: &next, depth: frame.depth() };
        let mut corners = CornerDetector::new(&config.corners)?;
        let not_seen = |found| Error::NotSeen { found, least: LEAST_CORNERS };
        let region = projected_bounds(&model, frame.camera(), &camera_from_object).ok_or(not_seen(0))?;
        let kcf = KcfTracker::new(next.base(), region, &config.kcf)?;
        let view =
            View::take(sight, &model, &camera_from_object, &mut corners, MARGIN, config.model_sigma, |_| {
                true
            })
            .ok_or(not_seen(0))?;
        if view.points.len() < LEAST_CORNERS {
            return Err(not_seen(view.points.len()));
        }
        let mut tracker = Self {
            config: config.clone(),
            label: label.map(str::to_owned),
            appearance: None,
            kcf,
            flow: OpticalFlow::new(&config.flow)?,
            corners,
            ransac: PoseRansac::new(&config.ransac)?,
            refiner: PoseRefiner::new(&config.refiner)?,
            tracks: Vec::new(),
            views: vec![view],
            motion: Motion::at_rest(
                *world_from_object,
                frame.timestamp(),
                [config.angular_acceleration, config.acceleration],
            ),
            rest: RestWatch::new(*world_from_object, frame.timestamp()),
            state: ObjectState::AtRest,
            time: frame.timestamp(),
            seen: frame.timestamp(),
            misses: 0,
            searches: 0,
            last: ImagePyramid::empty(config.flow.halvings),
            next,
            template: Template::default(),
            scratch: Scratch::default(),
            model,
        };
        tracker.appearance = tracker.appearance_in(frame, region, &camera_from_object);
        if let Some(fit) = tracker.fit(frame, &camera_from_object, None) {
            tracker.tracks = fit.sightings;
        }
        Ok(tracker)
    }

    /// Follows the object into the next frame. `detections` are looked at only when it has to be found again; they may
    /// be empty.
    ///
    /// # Errors
    ///
    /// [`Error::TimeReversed`], [`Error::NoColor`]. A refused frame changes nothing.
    pub fn track(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<ObjectUpdate, Error> {
        let color = frame.color().ok_or(Error::NoColor)?;
        if frame.timestamp() < self.time {
            return Err(Error::TimeReversed { previous: self.time, timestamp: frame.timestamp() });
        }
        self.time = frame.timestamp();
        std::mem::swap(&mut self.last, &mut self.next);
        self.next.build_from_color(color);

        let camera_from_world = world_from_camera.inverse();
        let predicted = camera_from_world * self.motion.predict(self.time);
        let window = self.kcf.locate(self.next.base());
        let is_window_good = window.peak_to_sidelobe >= LEAST_PEAK;
        let window_center = is_window_good.then(|| window.bounding_box.center().map(|c| c - 0.5));

        let prior = self.motion.prior(self.time, world_from_camera);
        let mut fit = self.follow(frame, &predicted, prior.as_ref(), window_center);
        if fit.is_none() {
            let standing = camera_from_world * *self.motion.last();
            if self.stands(frame, &standing) {
                return Ok(self.stand(frame, world_from_camera, &standing));
            }
            fit = self.search(frame, detections, &predicted, window_center);
        }
        Ok(match fit {
            Some(fit) => self.accept(frame, world_from_camera, fit),
            None => self.miss(frame, world_from_camera, &predicted),
        })
    }

    /// The object's surface.
    pub fn model(&self) -> &ObjectModel {
        &self.model
    }

    /// Its last known pose.
    pub fn world_from_object(&self) -> &Pose {
        self.motion.last()
    }

    /// Number of stored views.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// From the last frame: by the flow of its points, or by the motion alone.
    fn follow(
        &mut self,
        frame: &Frame,
        predicted: &Pose,
        prior: Option<&PosePrior>,
        window_center: Option<[f32; 2]>,
    ) -> Option<Fit> {
        if self.state == ObjectState::Lost {
            return None;
        }
        let camera = frame.camera();
        let guess = window_center.and_then(|center| {
            placed(camera, predicted, Place { center, depth: predicted.translation()[2] })
        });
        for start in [Some(*predicted), guess].into_iter().flatten() {
            if let Some(flowed) = self.flow_pose(frame, &start, prior)
                && let Some(fit) = self.fit(frame, &flowed, prior)
            {
                return Some(fit);
            }
        }
        let coarse = [Some(*predicted), guess];
        coarse.into_iter().flatten().find_map(|pose| self.fit(frame, &pose, prior))
    }

    /// The pose that the flow of the last frame's points agrees on.
    fn flow_pose(&mut self, frame: &Frame, start: &Pose, prior: Option<&PosePrior>) -> Option<Pose> {
        let camera = frame.camera();
        let Scratch { from, guesses, found, .. } = &mut self.scratch;
        from.clear();
        guesses.clear();
        for track in &self.tracks {
            from.push(track.pixel);
            let expected = camera.project(start.transform_point(track.position));
            guesses.push(expected.map_or(track.pixel, |pixel| pixel.map(|c| c as f32)));
        }
        self.flow.track_into(&self.last, &self.next, from, guesses, found);
        let tracked = self.tracks.iter().zip(&self.scratch.found);
        let tracked = tracked.filter(|(_, found)| found.status == FlowStatus::Tracked);
        let sightings: Vec<Sighting> =
            tracked.map(|(track, found)| Sighting { pixel: found.point, ..*track }).collect();
        self.agree(frame, &sightings, prior)
    }

    /// The pose that points agree on: in space where there is depth, else in the image.
    fn agree(&self, frame: &Frame, sightings: &[Sighting], prior: Option<&PosePrior>) -> Option<Pose> {
        let camera = frame.camera();
        let (mut in_object, mut in_camera) = (Vec::new(), Vec::new());
        for sighting in sightings {
            if let Some(reading) = reading_at(frame, sighting.pixel) {
                in_object.push(sighting.position);
                in_camera.push(camera.back_project(sighting.pixel.map(f64::from), reading));
            }
        }
        let in_space =
            (2 * in_object.len() >= sightings.len()).then(|| self.ransac.align(&in_object, &in_camera));
        let consensus = in_space.flatten().or_else(|| {
            let positions: Vec<_> = sightings.iter().map(|sighting| sighting.position).collect();
            let pixels: Vec<_> = sightings.iter().map(|sighting| sighting.pixel.map(f64::from)).collect();
            self.ransac.pnp(camera, &positions, &pixels)
        })?;
        // Readings are noisy, pixels are not: both together.
        let mut observations = Vec::with_capacity(2 * sightings.len());
        for sighting in sightings {
            self.observe(frame, sighting, &consensus.pose, 4.0, &mut observations);
        }
        let refined = self.refiner.refine_with(camera, &consensus.pose, &observations, prior)?;
        Some(refined.camera_from_body)
    }

    /// Adds a point's pixel and its depth, when that is near enough to be its own.
    fn observe(
        &self,
        frame: &Frame,
        sighting: &Sighting,
        pose: &Pose,
        sigma_factor: f64,
        observations: &mut Vec<PoseObservation>,
    ) {
        let point = sighting.position;
        let sigma = sighting.spread.hypot(sigma_factor * sighting.blur * self.config.pixel_sigma);
        observations.push(PoseObservation::Pixel { point, pixel: sighting.pixel.map(f64::from), sigma });
        if let Some(depth) = reading_at(frame, sighting.pixel) {
            let expected = pose.transform_point(point)[2];
            if (depth - expected).abs() < 2.0 * self.config.surface_gate {
                let sigma = self.config.depth_sigma_factor * f64::from(axial_noise(depth as f32));
                observations.push(PoseObservation::Depth { point, depth, sigma });
            }
        }
    }

    /// Finds points of stored views near a pose, and fits the pose to them and to the surface's readings. `None` when
    /// too few agree or the depth says that the object is elsewhere.
    fn fit(&mut self, frame: &Frame, coarse: &Pose, prior: Option<&PosePrior>) -> Option<Fit> {
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

    /// Looks for an object that its last points did not lead to.
    fn search(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        predicted: &Pose,
        window_center: Option<[f32; 2]>,
    ) -> Option<Fit> {
        self.searches += 1;
        let camera = frame.camera();
        let color = frame.color()?;
        let last_box = projected_bounds(&self.model, camera, predicted);
        let window = window_center.map(|_| self.kcf.bounding_box());
        let others: Vec<BoundingBox> = window.into_iter().chain(last_box).collect();
        let wanted = Wanted {
            model: &self.model,
            label: self.label.as_deref(),
            appearance: self.appearance.as_ref(),
            camera_from_object: *predicted,
        };
        let places = wanted.places(camera, color, frame.depth(), detections, &others);
        let attitudes = self.attitudes(predicted);
        // The last one in each frame, the others in turn.
        let others = attitudes.len().saturating_sub(1).max(1);
        let turn = |i: usize| 1 + (ATTITUDES_A_FRAME * self.searches + i) % others;
        let chosen: Vec<Pose> = std::iter::once(0)
            .chain((0..ATTITUDES_A_FRAME).map(turn))
            .filter_map(|i| attitudes.get(i).copied())
            .collect();
        for place in places {
            for attitude in &chosen {
                if let Some(start) = placed(camera, attitude, place)
                    && let Some(coarse) = self.pose_near(frame, &start)
                    && let Some(fit) = self.fit(frame, &coarse, None)
                    && fit.sightings.len() >= 2 * self.config.min_inliers
                {
                    return Some(fit);
                }
            }
        }
        None
    }

    /// How a lost object may be turned, as poses at any place: as it was last, as the stored views show it, the nearest
    /// first, and as it was turned by some more.
    fn attitudes(&self, predicted: &Pose) -> Vec<Pose> {
        let order = views_by_angle(&self.views, predicted, SAME_DIRECTION[0]);
        let seen = order.iter().filter_map(|&i| self.views.get(i)).map(|view| view.camera_from_object);
        let turned = [0, 1, 2].into_iter().flat_map(|axis| {
            [-TURNED, TURNED].map(|angle| {
                let mut turn = Vector6::zeros();
                turn[axis] = angle;
                moved(predicted, &turn)
            })
        });
        std::iter::once(*predicted).chain(seen.take(MOST_VIEWS_SEARCHED)).chain(turned).collect()
    }

    /// The pose about a rough one at which the image shows points of the view that is nearest to it.
    fn pose_near(&mut self, frame: &Frame, start: &Pose) -> Option<Pose> {
        let index = *views_by_angle(&self.views, start, SAME_DIRECTION[0]).first()?;
        let view = self.views.get(index)?;
        let count = view.points.len().min(POINTS_SEARCHED);
        let mut found = None;
        // Coarse levels may tell nothing: they only prepare.
        for halvings in (0..=HALVINGS_SEARCHED).rev() {
            let min_correlation =
                if halvings == 0 { self.config.min_correlation } else { COARSE_CORRELATION };
            let like = Likeness { halvings, min_correlation, ..self.config.likeness() };
            let sight = Sight { camera: frame.camera(), pyramid: &self.next, depth: frame.depth() };
            let (pose, template) = (found.unwrap_or(*start), &mut self.template);
            let sightings: Vec<Sighting> =
                (0..count).filter_map(|i| view.sight([index, i], sight, &pose, template, like)).collect();
            found = self.agree(frame, &sightings, None).or(found.filter(|_| halvings > 0));
        }
        found
    }

    /// Takes over a frame's pose.
    fn accept(&mut self, frame: &Frame, world_from_camera: &Pose, fit: Fit) -> ObjectUpdate {
        let world_from_object = *world_from_camera * fit.camera_from_object;
        let was_missing = self.misses > 0;
        if fit.is_found {
            self.motion.restart(&world_from_object, fit.covariance.as_ref(), self.time, world_from_camera);
        } else {
            self.motion.observe(&world_from_object, fit.covariance.as_ref(), self.time, world_from_camera);
        }
        (self.seen, self.searches, self.misses) = (self.time, 0, 0);
        // What is less well known wavers more.
        let [angle, distance] = fit.sigmas().unwrap_or_default();
        let limits = RestLimits {
            time: self.config.rest_time,
            distance: self.config.rest_distance.hypot(distance),
            angle: self.config.rest_angle.hypot(angle),
        };
        let came_to_rest = self.rest.observe(&world_from_object, self.time, limits);
        let is_hidden = fit.surface.tells() && fit.surface.hidden_share() > self.config.occluded_share;
        self.state = match () {
            () if was_missing => ObjectState::Recovered,
            () if is_hidden => ObjectState::Occluded,
            () if self.rest.is_resting() => ObjectState::AtRest,
            () => ObjectState::Tracking,
        };
        let bounding_box = projected_bounds(&self.model, frame.camera(), &fit.camera_from_object);
        self.correct_views(frame, &fit);
        if !is_hidden {
            self.learn(frame, &fit, bounding_box);
        }
        let visible = if fit.surface.tells() { 1.0 - fit.surface.hidden_share() } else { 1.0 };
        self.tracks = fit.sightings;
        ObjectUpdate {
            state: self.state,
            world_from_object,
            camera_from_object: fit.camera_from_object,
            covariance: fit.covariance,
            inliers: self.tracks.len(),
            confidence: fit.share * visible,
            bounding_box,
            came_to_rest,
        }
    }

    /// Corrects the points of stored views by where they were seen.
    fn correct_views(&mut self, frame: &Frame, fit: &Fit) {
        let Some(covariance) = &fit.covariance else { return };
        for sighting in &fit.sightings {
            if let Some(view) = self.views.get_mut(sighting.source[0]) {
                let pose = &fit.camera_from_object;
                view.correct(sighting, frame.camera(), pose, covariance, self.config.pixel_sigma);
            }
        }
    }

    /// Keeps the window on the object, and stores what it looks like from a new side.
    fn learn(&mut self, frame: &Frame, fit: &Fit, bounding_box: Option<BoundingBox>) {
        if let Some(region) = bounding_box {
            // Refused when it has nearly left the image: then there is nothing to learn.
            if self.kcf.move_to(self.next.base(), region).is_ok() {
                self.kcf.learn(self.next.base());
            }
        }
        let pose = &fit.camera_from_object;
        let nearest = self.views.iter().map(|view| view.angle_to(pose)).fold(f64::INFINITY, f64::min);
        let is_sure =
            fit.sightings.len() >= LEAST_FOR_VIEW && fit.share > 0.6 && fit.surface.hidden_share() < 0.4;
        // Without depth nothing corrects a view's points later.
        let is_known = fit.surface.tells() || fit.is_known(SURE);
        let has_few =
            fit.sightings.len() < self.config.max_points / 4 && nearest > 0.4 * self.config.view_angle;
        if is_sure
            && is_known
            && self.views.len() < self.config.max_views
            && (nearest > self.config.view_angle || has_few)
        {
            let sight = Sight { camera: frame.camera(), pyramid: &self.next, depth: frame.depth() };
            // Where there is depth, that tells what stands before the object.
            let hiding = (!fit.surface.tells()).then(|| Hiding::of(&self.views, frame.camera(), fit));
            if hiding.as_ref().is_some_and(|hiding| hiding.share() < LEAST_SHOWN) {
                return;
            }
            let is_shown = |pixel| hiding.as_ref().is_none_or(|hiding| hiding.is_shown(pixel));
            let (margin, sigma) = (MARGIN, self.config.model_sigma);
            let view = View::take(sight, &self.model, pose, &mut self.corners, margin, sigma, is_shown);
            self.views.extend(view);
        }
    }

    /// Whether an object at rest of which no point is found stands where it stood: half of it is out of view, or the depth
    /// shows it.
    fn stands(&self, frame: &Frame, camera_from_object: &Pose) -> bool {
        if !self.rest.is_resting() {
            return false;
        }
        let camera = frame.camera();
        let region = projected_bounds(&self.model, camera, camera_from_object);
        let share_on_image = |region: BoundingBox| {
            region.clipped(camera.width(), camera.height()).map_or(0.0, |part| part.area() / region.area())
        };
        if region.map_or(0.0, share_on_image) < 0.5 {
            return true;
        }
        // By the points of the views: they are readings, the model's surface may lie elsewhere.
        let places = self.views.iter().flat_map(|view| view.facing(camera, camera_from_object));
        let seen = SurfaceView::of_places(places, camera, frame.depth(), self.config.surface_gate);
        seen.seen >= LEAST_CORNERS && seen.seen_share() > LEAST_STANDING
    }

    /// A frame without points of an object at rest.
    fn stand(&mut self, frame: &Frame, world_from_camera: &Pose, camera_from_object: &Pose) -> ObjectUpdate {
        self.motion.stand(self.time);
        self.seen = self.time;
        self.tracks.clear();
        self.state = ObjectState::AtRest;
        self.unseen_update(frame, world_from_camera, camera_from_object)
    }

    /// A frame without a pose.
    fn miss(&mut self, frame: &Frame, world_from_camera: &Pose, predicted: &Pose) -> ObjectUpdate {
        self.misses += 1;
        self.tracks.clear();
        self.rest.unseen(self.time);
        let is_lost = self.time - self.seen > self.config.lost_after;
        self.state = if is_lost { ObjectState::Lost } else { ObjectState::Occluded };
        self.unseen_update(frame, world_from_camera, predicted)
    }

    fn unseen_update(
        &self,
        frame: &Frame,
        world_from_camera: &Pose,
        camera_from_object: &Pose,
    ) -> ObjectUpdate {
        ObjectUpdate {
            state: self.state,
            world_from_object: *world_from_camera * *camera_from_object,
            camera_from_object: *camera_from_object,
            covariance: None,
            inliers: 0,
            confidence: 0.0,
            bounding_box: projected_bounds(&self.model, frame.camera(), camera_from_object),
            came_to_rest: None,
        }
    }

    fn appearance_in(
        &self,
        frame: &Frame,
        region: BoundingBox,
        camera_from_object: &Pose,
    ) -> Option<Appearance> {
        let object_from_camera = camera_from_object.inverse();
        let on_object = |u: usize, v: usize| {
            let reading = frame.depth().at(u, v);
            let place = frame.camera().back_project([u as f64, v as f64], reading.into());
            reading > 0.0 && self.model.contains(object_from_camera.transform_point(place), MARGIN)
        };
        let color = frame.color()?;
        Appearance::of(color, region, on_object).or_else(|| Appearance::of(color, region, |_, _| true))
    }
}

/// A pose turned with the ray so that the object's origin appears at a place, showing the same side.
fn placed(camera: &PinholeCamera, pose: &Pose, place: Place) -> Option<Pose> {
    let center = place.center.map(f64::from);
    let origin = camera.back_project(center, place.depth);
    let bearing = |p: [f64; 3]| {
        let distance = norm(p);
        p.map(|x| x / distance)
    };
    // The shortest turn from the old ray to the new one.
    let axis = cross(bearing(pose.translation()), bearing(origin));
    let sine = norm(axis);
    let angle = sine.clamp(0.0, 1.0).asin();
    let turn =
        crate::pose::rotation_about(if sine > 1e-12 { axis.map(|x| x / sine * angle) } else { [0.0; 3] });
    Pose::new(origin, (turn * *pose).quaternion()).ok()
}

/// The reading at a pixel, if there is one.
fn reading_at(frame: &Frame, pixel: [f32; 2]) -> Option<f64> {
    let [u, v] = pixel.map(f32::round);
    if u < 0.0 || v < 0.0 {
        return None;
    }
    let reading = frame.depth().at(u as usize, v as usize);
    (reading > 0.0).then(|| reading.into())
}

/// A reading at the object's origin.
fn reading_near(frame: &Frame, pose: &Pose) -> Option<f64> {
    let pixel = frame.camera().project(pose.translation())?;
    reading_at(frame, pixel.map(|c| c as f32))
}

/// Whether something stands before a point at a pose.
fn is_hidden(frame: &Frame, pose: &Pose, position: [f64; 3], gate: f64) -> bool {
    let place = pose.transform_point(position);
    let Some(pixel) = frame.camera().project(place) else { return true };
    reading_at(frame, pixel.map(|c| c as f32)).is_some_and(|reading| place[2] - reading > 1.5 * gate)
}

/// Indices of the views, those nearest in direction first, in steps of `step` radians; older ones first within a step.
fn views_by_angle(views: &[View], pose: &Pose, step: f64) -> Vec<usize> {
    let mut order: Vec<(f64, usize)> =
        views.iter().enumerate().map(|(i, view)| ((view.angle_to(pose) / step).floor(), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|(_, i)| i).collect()
}

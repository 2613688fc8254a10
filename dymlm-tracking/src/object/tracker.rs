mod fit;
mod follow;
mod learn;
mod readings;
mod search;

use dymlm_core::{BoundingBox, Detection, Frame, Pose};

use self::learn::MARGIN;
use super::motion::Motion;
use super::recovery::Appearance;
use super::state::{ObjectState, RestLimits, RestReport, RestWatch};
use super::surface::SurfaceView;
use super::view::{Sight, Sighting, View, projected_bounds};
use super::{ObjectModel, ObjectTrackerConfig};
use crate::flow::Template;
use crate::{
    CornerDetector, Error, FlowPoint, ImagePyramid, KcfTracker, OpticalFlow, PoseObservation, PoseRansac,
    PoseRefiner,
};

pub(super) use self::fit::Fit;

/// Corners needed at the start, and readings that say that it stands.
const LEAST_CORNERS: usize = 6;
/// The window tracker is asked where the object is only when its peak stands out so far.
const LEAST_PEAK: f32 = 6.0;
/// Least share of an object's surface in view that the depth shows if it stands.
const LEAST_STANDING: f64 = 0.5;

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
}

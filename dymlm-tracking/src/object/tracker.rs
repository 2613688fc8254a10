use dymlm_core::{BoundingBox, Detection, Frame, Pose, SensorModel};

use super::config::ObjectTrackerConfig;
use super::fit::Fit;
use super::likely_places::Place;
use super::model::ObjectModel;
use super::motion::Motion;
use super::pixel_lengths::{HALVINGS, PixelLengths};
use super::point_flow::PointFlow;
use super::pose_fitter::PoseFitter;
use super::rest_watch::{RestLimits, RestWatch};
use super::scene::Scene;
use super::search::{Clues, Search, placed};
use super::state::{ObjectState, RestReport};
use super::surface::SurfaceReadings;
use super::view::PointMatch;
use super::view_store::{LEAST_CORNERS, ViewStore};
use crate::pose::PosePrior;
use crate::{Error, ImagePyramid, KcfConfig, KcfTracker};

/// Time over which errors of frames are correlated, seconds. With 0, a turned box is off by 1.1 degrees
/// instead of 0.8 in every twentieth frame.
const LIKE_TIME: f64 = 0.3;

/// Tracks a chosen object that is moved by hand, in six degrees of freedom.
///
/// The paper's application (section V-D). In each frame
/// 1. a correlation filter ([`KcfTracker`]) and the last motion predict where the object is;
/// 2. optical flow ([`OpticalFlow`](crate::OpticalFlow)) takes its points there, and a consensus on their motion - 3D-3D where
///    there is depth, else perspective-n-point ([`PoseRansac`](crate::PoseRansac)) - gives a pose;
/// 3. points of stored views, warped to that pose, are found in the image to a fraction of a pixel, and the
///    depth inside the silhouette is compared with the model's surface: a fit to all of it ([`PoseRefiner`](crate::PoseRefiner))
///    is the frame's pose. Both are anchored to the object, so errors do not add up from frame to frame;
/// 4. a view is stored when a new side is visible; when the object comes to rest, that is reported.
///
/// When no pose is found, the object is searched in detected boxes of its label, at the filter's box, and at
/// its last place. Without depth readings the tracker uses pixels alone.
///
/// A frame of 640x480 takes 3 to 7 ms on one core. A tracker knows the world by the poses that it is given: where
/// a SLAM corrects them, tell it ([`Self::move_world`]).
#[derive(Debug, Clone)]
pub struct ObjectTracker {
    config: ObjectTrackerConfig,
    sensor: SensorModel,
    model: ObjectModel,
    kcf: KcfTracker,
    flow: PointFlow,
    views: ViewStore,
    fitter: PoseFitter,
    search: Search,
    /// Points of the last frame that agreed with its pose.
    tracks: Vec<PointMatch>,
    motion: Motion,
    rest: RestWatch,
    state: ObjectState,
    /// Time of the last frame, and of the last one with a pose.
    time: f64,
    seen: f64,
    last: ImagePyramid,
    next: ImagePyramid,
}

/// What a frame says about the object.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectUpdate {
    /// The state of the object.
    pub state: ObjectState,
    /// Its pose. When `inliers` is 0, this is the last pose (at rest) or a prediction (occluded or lost).
    pub world_from_object: Pose,
    /// Its pose in the camera's frame.
    pub camera_from_object: Pose,
    /// Covariance of (rotation about the camera's axes, radians; origin, metres), by rows; `None` when this
    /// frame gave no pose, or left a direction undetermined.
    pub covariance: Option<[[f64; 6]; 6]>,
    /// Number of points that agree with the pose.
    pub inliers: usize,
    /// Share of the matched points that agree, times the share of the surface in view that is not occluded;
    /// 0..=1.
    pub confidence: f64,
    /// The box of the object's bounds in the image, pixels, which may exceed the image. `None` behind the
    /// camera.
    pub bounding_box: Option<BoundingBox>,
    /// Set when it came to rest at a new place in this frame.
    pub came_to_rest: Option<RestReport>,
}

impl ObjectTracker {
    /// Starts to track an object that is at rest at `world_from_object` and in view. `label` is the
    /// detector's name for it, which helps to find it again. Lengths in pixels are chosen for the frame's
    /// camera.
    ///
    /// # Errors
    ///
    /// [`Error::Config`], also of the sensor; [`Error::NoColor`]; [`Error::TargetSize`] when too little of
    /// the object is on the image; [`Error::NotSeen`] when fewer than six corners are found on it.
    pub fn new(
        frame: &Frame,
        world_from_camera: &Pose,
        model: ObjectModel,
        label: Option<&str>,
        world_from_object: &Pose,
        sensor: SensorModel,
        config: &ObjectTrackerConfig,
    ) -> Result<Self, Error> {
        config.validate()?;
        sensor.validate()?;
        let color = frame.color().ok_or(Error::NoColor)?;
        let (camera, time) = (frame.camera(), frame.timestamp());
        let camera_from_object = world_from_camera.inverse() * *world_from_object;
        let lengths = PixelLengths::of(camera);
        let mut next = ImagePyramid::empty(HALVINGS);
        next.build_from_color(color);
        let not_seen = Error::NotSeen { found: 0, least: LEAST_CORNERS };
        let region = model.bounds_in_image(camera, &camera_from_object).ok_or(not_seen)?;
        // A larger padding than the default for people: a hand moves fast.
        let kcf = KcfConfig { padding: 2.5, template_size: 96, ..KcfConfig::default() };
        let kcf = KcfTracker::new(next.base(), region, &kcf)?;
        let scene = Scene { camera, pyramid: &next, depth: frame.depth(), sensor: &sensor };
        let (points, sigma) = (config.max_points, config.model_sigma);
        let mut views = ViewStore::new(scene, &model, &camera_from_object, points, sigma)?;
        let mut fitter = PoseFitter::new(lengths.consensus, sigma)?;
        let fit = fitter.fit(scene, &model, &mut views, &camera_from_object, None);
        let accelerations = [config.angular_acceleration, config.acceleration];
        Ok(Self {
            config: config.clone(),
            sensor,
            model,
            kcf,
            flow: PointFlow::new(&lengths)?,
            views,
            fitter,
            search: Search::new(label),
            tracks: fit.map_or_else(Vec::new, |fit| fit.matches),
            motion: Motion::at_rest(*world_from_object, time, accelerations, config.lost_after),
            rest: RestWatch::new(*world_from_object, time),
            state: ObjectState::AtRest,
            time,
            seen: time,
            last: ImagePyramid::empty(HALVINGS),
            next,
        })
    }

    /// Tracks the object into the next frame. `detections` are only used when it has to be found again; they
    /// may be empty.
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
        let prior = self.motion.prior(self.time, world_from_camera);
        let window = self.kcf.locate(self.next.base()).bounding_box;

        if let Some(fit) = self.follow(frame, &predicted, prior.as_ref(), window) {
            return Ok(self.accept(frame, world_from_camera, fit));
        }
        let standing = camera_from_world * *self.motion.last();
        if self.stands(frame, &standing) {
            return Ok(self.stand(frame, world_from_camera, &standing));
        }
        let scene =
            Scene { camera: frame.camera(), pyramid: &self.next, depth: frame.depth(), sensor: &self.sensor };
        let clues = Clues { detections, predicted, window };
        Ok(match self.search.find(scene, &self.model, &mut self.views, &mut self.fitter, &clues) {
            Some(fit) => self.accept(frame, world_from_camera, fit),
            None => self.miss(frame, world_from_camera, &predicted),
        })
    }

    /// Converts what is known of the object's place and motion after the world frame was moved, as by a loop
    /// closure; poses of later frames are in the new frame. Without this a jump of the poses is taken for a
    /// motion of the object.
    pub fn move_world(&mut self, new_from_old: &Pose) {
        self.motion.move_world(new_from_old);
        self.rest.move_world(new_from_old);
    }

    /// The object's surface.
    pub fn model(&self) -> &ObjectModel {
        &self.model
    }

    /// The object's last known pose.
    #[doc(alias = "T_wo")]
    pub fn world_from_object(&self) -> &Pose {
        self.motion.last()
    }

    /// Number of stored views.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// Tracks from the last frame, starting from the predicted pose, then from the window tracker's box:
    /// first by the flow of its points, then without flow.
    fn follow(
        &mut self,
        frame: &Frame,
        predicted: &Pose,
        prior: Option<&PosePrior>,
        window: BoundingBox,
    ) -> Option<Fit> {
        if self.state == ObjectState::Lost {
            return None;
        }
        let camera = frame.camera();
        let scene = Scene { camera, pyramid: &self.next, depth: frame.depth(), sensor: &self.sensor };
        let center = window.center().map(|c| c - 0.5);
        let in_window = placed(camera, predicted, Place { center, depth: predicted.translation()[2] });
        let starts = [Some(*predicted), in_window];
        let (model, views, fitter) = (&self.model, &mut self.views, &mut self.fitter);
        for start in starts.into_iter().flatten() {
            let matches = self.flow.follow(&self.last, scene, &self.tracks, &start);
            if let Some(flowed) = fitter.agree(scene, &matches, prior)
                && let Some(fit) = fitter.fit(scene, model, views, &flowed, prior)
            {
                return Some(fit);
            }
        }
        starts.into_iter().flatten().find_map(|start| fitter.fit(scene, model, views, &start, prior))
    }

    /// Takes over a frame's pose.
    fn accept(&mut self, frame: &Frame, world_from_camera: &Pose, fit: Fit) -> ObjectUpdate {
        let world_from_object = *world_from_camera * fit.camera_from_object;
        let was_missing = self.tracks.is_empty() && self.state != ObjectState::AtRest;
        let take = if fit.is_found { Motion::restart } else { Motion::observe };
        take(&mut self.motion, &world_from_object, fit.covariance.as_ref(), self.time, world_from_camera);
        let elapsed = self.time - std::mem::replace(&mut self.seen, self.time);
        self.search.end();
        // A less certain pose jitters more.
        let [angle, distance] = fit.sigmas().unwrap_or_default();
        let limits = RestLimits {
            time: self.config.rest_time,
            distance: self.config.rest_distance.hypot(distance),
            angle: self.config.rest_angle.hypot(angle),
        };
        let came_to_rest = self.rest.observe(&world_from_object, self.time, limits);
        let occluded_share = if fit.surface.has_enough() { fit.surface.occluded_share() } else { 0.0 };
        let is_occluded = fit.surface.has_enough() && fit.surface.is_mostly_occluded();
        self.state = match () {
            () if was_missing => ObjectState::Recovered,
            () if is_occluded => ObjectState::Occluded,
            () if self.rest.is_resting() => ObjectState::AtRest,
            () => ObjectState::Tracking,
        };
        let bounding_box = self.model.bounds_in_image(frame.camera(), &fit.camera_from_object);
        let scene =
            Scene { camera: frame.camera(), pyramid: &self.next, depth: frame.depth(), sensor: &self.sensor };
        self.views.correct(scene, &fit, (LIKE_TIME / elapsed.max(1e-3)).sqrt().max(1.0));
        if !is_occluded {
            // Refused when the object has nearly left the image: then there is nothing to learn.
            if bounding_box.is_some_and(|region| self.kcf.move_to(self.next.base(), region).is_ok()) {
                self.kcf.learn(self.next.base());
            }
            self.views.learn(scene, &self.model, &fit);
        }
        self.tracks = fit.matches;
        ObjectUpdate {
            state: self.state,
            world_from_object,
            camera_from_object: fit.camera_from_object,
            covariance: fit.covariance,
            inliers: self.tracks.len(),
            confidence: fit.share * (1.0 - occluded_share),
            bounding_box,
            came_to_rest,
        }
    }

    /// Whether an object at rest still stands in its place although no point of it is found: more than half
    /// of it is out of view, or the depth shows it.
    fn stands(&self, frame: &Frame, camera_from_object: &Pose) -> bool {
        if !self.rest.is_resting() {
            return false;
        }
        let camera = frame.camera();
        let region = self.model.bounds_in_image(camera, camera_from_object);
        let share_on_image = |region: BoundingBox| {
            region.clipped(camera.width(), camera.height()).map_or(0.0, |part| part.area() / region.area())
        };
        if region.map_or(0.0, share_on_image) < 0.5 {
            return true;
        }
        // Checks the points of the views: they came from readings, while the model's surface may be off.
        let scene = Scene { camera, pyramid: &self.next, depth: frame.depth(), sensor: &self.sensor };
        let places = self.views.facing(scene, camera_from_object);
        let readings = SurfaceReadings::of_places(places, scene, self.config.model_sigma);
        readings.present >= LEAST_CORNERS && readings.is_mostly_present()
    }

    /// Handles a frame that shows no points of an object at rest.
    fn stand(&mut self, frame: &Frame, world_from_camera: &Pose, camera_from_object: &Pose) -> ObjectUpdate {
        self.motion.stand(self.time);
        self.seen = self.time;
        self.tracks.clear();
        self.state = ObjectState::AtRest;
        self.unseen_update(frame, world_from_camera, camera_from_object)
    }

    /// Handles a frame without a pose.
    fn miss(&mut self, frame: &Frame, world_from_camera: &Pose, predicted: &Pose) -> ObjectUpdate {
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
            bounding_box: self.model.bounds_in_image(frame.camera(), camera_from_object),
            came_to_rest: None,
        }
    }
}

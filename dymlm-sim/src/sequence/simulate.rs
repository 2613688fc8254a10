use std::mem::take;

use dymlm_core::{BoundingBox, ColorImage, DepthImage, Error, Frame, Mask, PinholeCamera, Pose, check_range};
use dymlm_geometry::OrientedBox;
use parry3d::math::{Pose3, Rot3};

use super::pose_error::PoseError;
use super::simulated_frame::{CarriedThing, PlaceChange, SceneChange, SimulatedFrame, VisibleThing};
use super::{FrameScratch, Frames, SequenceConfig};
use crate::detector::{Detector, Visible, visible_things};
use crate::render::{Rendering, render};
use crate::scene::{Part, Room, Scene, Stage};
use crate::sensor::Sensor;
use crate::to_pose::to_pose;

/// A synthetic recording: frames by index, each a function of the config and the index alone.
///
/// A frame costs O(pixels); with the feature `parallel` its rows are shared among cores, and
/// the bits stay the same.
///
/// ```
/// use dymlm_core::PinholeCamera;
/// use dymlm_sim::{Sequence, SequenceConfig};
///
/// let mut config = SequenceConfig::default();
/// config.camera = Some(PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?);
/// let sequence = Sequence::new(&config)?;
/// let frame = sequence.frame(20).ok_or("a sequence of 150 frames")?;
/// assert_eq!(frame.frame.timestamp(), 2.0);
/// assert!(sequence.frame(150).is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Sequence {
    config: SequenceConfig,
    camera: PinholeCamera,
    scene: Scene,
    sensor: Sensor,
    detector: Detector,
    pose_error: Option<PoseError>,
}

impl Sequence {
    /// The sequence that a config describes: by default an office in which one person walks up and down
    /// before the desk and another round the room, at 0.6 to 1 m/s and mostly 1 to 2.5 m from the camera.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] when a field of the config is outside its range, or an event finds no place.
    pub fn new(config: &SequenceConfig) -> Result<Self, Error> {
        config.validate()?;
        let camera = match config.camera {
            Some(camera) => camera,
            None => PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?,
        };
        let noise_seed = noise_seed(config);
        let mut sequence = Self {
            config: config.clone(),
            camera,
            scene: Scene::new(config),
            sensor: Sensor::new(config.sensor, noise_seed),
            detector: Detector::new(config.detector, noise_seed),
            pose_error: None,
        };
        if let (Some(what), Room::Office, None) = (config.carried, config.room, &config.plan) {
            sequence.scene.carry(what);
        }
        sequence.stage_day();
        sequence.stage_events()?;
        sequence.pose_error = sequence.pose_errors();
        Ok(sequence)
    }

    /// Finds places for the events, clear of the camera and well in its view.
    fn stage_events(&mut self) -> Result<(), Error> {
        /// Moments of the sequence at which the camera's view is tested.
        const MOMENTS: usize = 12;
        let cameras = self.cameras_at(MOMENTS);
        let stage = self.stage(&cameras);
        for (number, &event) in self.config.events.iter().enumerate() {
            let staged = self.scene.stage(event, &stage, [self.config.seed, number as u64]);
            check_range("places for an event", f64::from(u8::from(staged.is_some())), 1.0..=f64::INFINITY)?;
        }
        Ok(())
    }

    /// Puts the things where they stand on the day of the recording.
    fn stage_day(&mut self) {
        if self.config.day == 0 {
            return;
        }
        // Twice a second, since a thing on the camera's path is in the way all the time.
        let cameras = self.cameras_at((2.0 * self.timestamp(self.len())).ceil() as usize);
        let (seed, day) = (self.config.seed, self.config.day);
        let mut scene = self.scene.clone();
        scene.rearrange(&self.stage(&cameras), seed, day);
        self.scene = scene;
    }

    /// The camera's poses in the scene at `moments` frames spread over the sequence.
    fn cameras_at(&self, moments: usize) -> Vec<Pose3> {
        (0..moments).map(|k| self.scene_from_camera(self.len() * k / moments)).collect()
    }

    fn stage<'a>(&self, cameras: &'a [Pose3]) -> Stage<'a> {
        // Without a twentieth of the image at each border.
        let between = |side: usize, focal_length: f64, center: f64| {
            let tangents =
                [0.05, 0.95].map(|share| ((share * side as f64 - 0.5 - center) / focal_length) as f32);
            [tangents[0].min(tangents[1]), tangents[0].max(tangents[1])]
        };
        let camera = &self.camera;
        Stage {
            cameras,
            view: [
                between(camera.width(), camera.fx(), camera.cx()),
                between(camera.height(), camera.fy(), camera.cy()),
            ],
            duration: self.timestamp(self.len()),
            last: self.timestamp(self.len().saturating_sub(1)),
            time: self.config.event_time,
        }
    }

    fn pose_errors(&self) -> Option<PoseError> {
        let exact = (0..self.len()).map(|index| self.world_from_camera(index));
        PoseError::new(&self.config.pose_error, noise_seed(&self.config), 1.0 / self.config.frame_rate, exact)
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.config.frames
    }

    /// Always false: a sequence has at least one frame.
    pub fn is_empty(&self) -> bool {
        self.config.frames == 0
    }

    /// The config that the sequence was made with.
    pub fn config(&self) -> &SequenceConfig {
        &self.config
    }

    /// The camera.
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// Time of frame `index`, seconds from the first.
    pub fn timestamp(&self, index: usize) -> f64 {
        index as f64 / self.config.frame_rate
    }

    /// The exact pose of frame `index`, past the end as well.
    pub fn world_from_camera(&self, index: usize) -> Pose {
        self.config.world_from_scene * to_pose(&self.scene_from_camera(index))
    }

    /// The pose of frame `index` as estimated when the frame is taken; the exact pose when the config asks
    /// for no errors, and past the end.
    pub fn estimated_pose(&self, index: usize) -> Pose {
        let estimate = self.pose_error.as_ref().and_then(|error| error.estimate(index));
        estimate.unwrap_or_else(|| self.world_from_camera(index))
    }

    /// The poses of frames 0 to `at_frame` (or to the end) as the back end knows them when frame `at_frame`
    /// is taken: before a loop closure the estimated poses, from then on the corrected poses of all frames.
    pub fn corrected_poses(&self, at_frame: usize) -> Vec<Pose> {
        match &self.pose_error {
            Some(error) => error.estimates_at(at_frame),
            None => (0..self.len().min(at_frame.saturating_add(1)))
                .map(|index| self.world_from_camera(index))
                .collect(),
        }
    }

    /// The frame at which the loop closes: a map that follows the poses takes the
    /// [`corrected_poses`](Self::corrected_poses) then. `None` when no loop closes within the sequence, or
    /// poses are exact.
    pub fn loop_closure_frame(&self) -> Option<usize> {
        self.pose_error.as_ref().and_then(PoseError::closure_frame)
    }

    /// The thing that a hand carries in frame `index`, past the end as well; `None` when the config asks for
    /// none.
    pub fn carried_thing(&self, index: usize) -> Option<CarriedThing> {
        let carried = self.scene.carried.as_ref()?;
        let scene_from_object = carried.scene_from_object(self.timestamp(index));
        Some(CarriedThing {
            id: carried.instance,
            label: carried.kind().label(),
            world_from_object: self.config.world_from_scene * to_pose(&scene_from_object),
            lengths: carried.kind().lengths().map(f64::from),
        })
    }

    /// What the events change for good, in the order of the config; a trolley, which never rests, and a door,
    /// which closes again, change nothing.
    pub fn changes(&self) -> Vec<SceneChange> {
        let in_world = |area: OrientedBox| area.transformed(&self.config.world_from_scene);
        let changes = self.scene.happenings.iter().filter_map(|happening| {
            let [before, after] = self.scene.places_of(happening).map(|place| place.map(in_world));
            (before != after).then(|| SceneChange {
                event: happening.event,
                id: happening.instance,
                label: self.scene.instances.get(happening.instance).and_then(|thing| thing.label),
                times: [happening.begin, happening.end],
                before,
                after,
            })
        });
        changes.collect()
    }

    /// The labelled things that stand elsewhere than in an earlier sequence of the same rooms, such as one of
    /// another [`day`](SequenceConfig::day), or that are in only one of the two.
    pub fn differences_from(&self, earlier: &Self) -> Vec<PlaceChange> {
        let in_world = |sequence: &Self, id: usize| {
            Some(sequence.scene.place_of(id)?.transformed(&sequence.config.world_from_scene))
        };
        let label = |sequence: &Self, id: usize| sequence.scene.instances.get(id).and_then(|it| it.label);
        let ids = 0..self.scene.instances.len().max(earlier.scene.instances.len());
        let changes = ids.filter_map(|id| {
            let label = label(self, id).or_else(|| label(earlier, id))?;
            let [before, after] = [in_world(earlier, id), in_world(self, id)];
            (before != after).then_some(PlaceChange { id, label, before, after })
        });
        changes.collect()
    }

    /// Renders frame `index`; `None` past the end.
    pub fn frame(&self, index: usize) -> Option<SimulatedFrame> {
        self.frame_with(index, &mut FrameScratch::default())
    }

    /// [`frame`](Self::frame) with buffers that are reused: the same bits, and no allocation of images once
    /// [`FrameScratch::recycle`] has been given a frame.
    pub fn frame_with(&self, index: usize, scratch: &mut FrameScratch) -> Option<SimulatedFrame> {
        if index >= self.len() {
            return None;
        }
        let time = self.timestamp(index);
        let mut masks = [(); 2].map(|()| scratch.take_mask(self.camera.width(), self.camera.height()));
        let FrameScratch { rendering: exact, places, readings, parts, moving, .. } = scratch;
        self.scene.parts_at(time, parts, moving);
        render(&self.camera, &self.scene_from_camera(index), parts, exact);
        self.sensor.sense(&self.camera, exact, parts, index, places, readings);
        let visible = visible_things(exact, parts, self.scene.instances.len());
        let detections = self.detector.detect(exact, &visible, &self.scene, index, time);
        let [Some(mover_mask), Some(transient_mask)] = &mut masks else { return None };
        mark(exact, parts, mover_mask, |thing| self.scene.moves(thing, time));
        mark(exact, parts, transient_mask, |thing| self.scene.is_away(thing, time));
        let [mover_mask, transient_mask] = masks;

        let (width, height) = (exact.width, exact.height);
        let depth = DepthImage::new(width, height, take(readings)).ok()?;
        let color = ColorImage::new(width, height, take(&mut exact.color)).ok()?;
        Some(SimulatedFrame {
            frame: Frame::new(time, self.camera, depth, Some(color)).ok()?,
            detections,
            world_from_camera: self.world_from_camera(index),
            estimated_world_from_camera: self.estimated_pose(index),
            true_depth: DepthImage::new(width, height, take(&mut exact.depth)).ok()?,
            mover_mask: mover_mask?,
            transient_mask: transient_mask?,
            visible_things: self.labelled_things(&visible, time),
            carried: self.carried_thing(index),
            parts: take(&mut exact.part),
        })
    }

    /// All frames in order. Frames that `step_by`, `skip` or `nth` leave out are not rendered.
    pub fn frames(&self) -> Frames<'_> {
        Frames { sequence: self, left: 0..self.len() }
    }

    pub(crate) fn scene(&self) -> &Scene {
        &self.scene
    }

    fn labelled_things(&self, visible: &[Option<Visible>], time: f64) -> Vec<VisibleThing> {
        let things = self.scene.instances.iter().zip(visible).enumerate();
        let labelled = things.filter_map(|(id, (thing, visible))| {
            let (label, visible) = (thing.label?, (*visible)?);
            let [x, y] = [visible.x, visible.y].map(|side| side.map(|c| c as f32));
            let bounding_box = BoundingBox::new(x[0], y[0], x[1], y[1]).ok()?;
            Some(VisibleThing {
                id,
                label,
                moves: self.scene.moves(id, time),
                bounding_box,
                pixels: visible.pixels,
            })
        });
        labelled.collect()
    }

    fn scene_from_camera(&self, index: usize) -> Pose3 {
        let upright = self.scene.scene_from_camera(self.config.path, self.timestamp(index));
        let turned = |rotation: Rot3| Pose3::from_rotation(rotation);
        let SequenceConfig { camera_pitch, camera_roll, .. } = self.config;
        // Without pitch and roll the pose stays as it is, to the bit.
        let pitched = if camera_pitch == 0.0 {
            upright
        } else {
            upright * turned(Rot3::from_rotation_x(-camera_pitch as f32))
        };
        if camera_roll == 0.0 { pitched } else { pitched * turned(Rot3::from_rotation_z(camera_roll as f32)) }
    }
}

/// The seed of all that errs, which is another on each day: of readings, detections and estimated poses. On
/// day 0 it is the sequence's own.
fn noise_seed(config: &SequenceConfig) -> u64 {
    config.seed.wrapping_add(config.day.wrapping_mul(0x9E37_79B9_7F4A_7C15))
}

/// Sets each pixel of the mask to whether it shows a thing that `is_marked` selects.
fn mark(exact: &Rendering, parts: &[Part], mask: &mut Mask, is_marked: impl Fn(usize) -> bool) {
    let marked: Vec<bool> = parts.iter().map(|part| is_marked(part.instance)).collect();
    mask.fill(false);
    if !marked.contains(&true) {
        return;
    }
    for (v, row) in exact.part.chunks(exact.width).enumerate() {
        let mut end = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let columns = end..end + run.len();
            end = columns.end;
            if run.first().is_some_and(|&part| marked.get(usize::from(part)) == Some(&true)) {
                mask.fill_row(v, columns, true);
            }
        }
    }
}

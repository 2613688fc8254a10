use std::f64::consts::{FRAC_PI_2, PI, TAU};

use dymlm_core::{ConfigError, PinholeCamera, Pose, check_range};

use rand::RngExt;

use super::PoseErrorConfig;
use crate::noise::{Use, stream};
use crate::scene::{SECONDS_A_ROOM, tour_seconds};
use crate::{
    Activity, BuildingPlan, CameraPath, CarriedObject, DetectorConfig, Room, SceneEvent, SensorConfig,
};

/// What a [`Sequence`](crate::Sequence) shows.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SequenceConfig {
    /// Number of frames, 1..=1000000, default 150: 15 s.
    pub frames: usize,
    /// Frames a second, 0.1..=1000, default 10.
    pub frame_rate: f64,
    /// Seed of everything random: noise, the detector's failures, the people's start, speed and gestures, and
    /// the whole room when it is [`Room::Random`]. Default 7.
    pub seed: u64,
    /// The camera. Default `None`: 640x480, f = 525 px, principal point in the middle (a Kinect).
    pub camera: Option<PinholeCamera>,
    /// The room. Default [`Room::Office`].
    pub room: Room,
    /// A building made from a floor plan, which takes the place of the room; furniture, people and the camera's
    /// tour, which lasts at most as long as the frames, are drawn from the seed. Default `None`.
    pub plan: Option<BuildingPlan>,
    /// What the people do. Default [`Activity::Walking`].
    pub activity: Activity,
    /// The day of the recording, 0..=1000, default 0: on each other day, some chairs, plants and suitcases
    /// stand elsewhere, some are gone, some are new, and the noise differs.
    pub day: u64,
    /// How the camera moves. Default [`CameraPath::Handheld`].
    pub path: CameraPath,
    /// Turn of the camera about its optical axis, radians, -pi..=pi, default 0: a quarter turn holds it on
    /// its side.
    pub camera_roll: f64,
    /// By how much the camera is tilted downwards, radians, -pi/2..=pi/2, default 0; applied before the roll.
    pub camera_pitch: f64,
    /// Pose of the room in the world; in the room's own frame z is up and the floor is z = 0. Default
    /// identity. A tilted world shows whether a map depends on the direction of gravity.
    pub world_from_scene: Pose,
    /// Number of people, in a building the number in each room where people are, in one made from a floor plan on each
    /// way through it too, 0..=2, default 2.
    pub people: usize,
    /// Whether the people have heights and clothes drawn from the seed. Default false: the same two people in
    /// all sequences.
    pub strangers: bool,
    /// Events apart from the people's motion, which no detector reports. Default none.
    pub events: Vec<SceneEvent>,
    /// When events happen, seconds, 0..=1e9. Default `None`: each at a moment of its own in the second
    /// quarter of the sequence, drawn from the seed.
    pub event_time: Option<f64>,
    /// A thing that a hand takes from a small table before the camera's station, moves for six seconds and
    /// puts down again; the camera looks at it. Only in [`Room::Office`]. Default `None`.
    pub carried: Option<CarriedObject>,
    /// The depth camera's errors.
    pub sensor: SensorConfig,
    /// The detector's errors.
    pub detector: DetectorConfig,
    /// The errors of the estimated poses.
    pub pose_error: PoseErrorConfig,
}

impl Default for SequenceConfig {
    fn default() -> Self {
        Self {
            frames: 150,
            frame_rate: 10.0,
            seed: 7,
            camera: None,
            room: Room::default(),
            plan: None,
            activity: Activity::default(),
            day: 0,
            path: CameraPath::default(),
            camera_roll: 0.0,
            camera_pitch: 0.0,
            world_from_scene: Pose::identity(),
            people: 2,
            strangers: false,
            events: Vec::new(),
            event_time: None,
            carried: None,
            sensor: SensorConfig::default(),
            detector: DetectorConfig::default(),
            pose_error: PoseErrorConfig::default(),
        }
    }
}

impl SequenceConfig {
    /// A sequence in a room generated from `seed`, with one of the camera's paths. The world of odd seeds is
    /// turned and shifted at random ([`world_from_scene`](Self::world_from_scene)); with even seeds it is
    /// upright.
    ///
    /// ```
    /// use dymlm_sim::{Activity, Sequence, SequenceConfig};
    ///
    /// let mut config = SequenceConfig::random_room(12);
    /// config.activity = Activity::Sitting;
    /// assert_eq!(Sequence::new(&config)?.len(), 150);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn random_room(seed: u64) -> Self {
        const PATHS: [CameraPath; 4] =
            [CameraPath::Handheld, CameraPath::Xyz, CameraPath::HalfSphere, CameraPath::Rpy];
        let mut rng = stream(seed, Use::Scene, 1, 0);
        let path = PATHS[rng.random_range(0..PATHS.len())];
        let turned = random_pose(std::array::from_fn(|_| rng.random_range(0.0..1.0)));
        let world_from_scene = if seed % 2 == 1 { turned } else { Pose::identity() };
        Self { room: Room::Random, seed, path, world_from_scene, ..Self::default() }
    }

    /// A building of 2 to 60 rooms generated from `seed`; the frames, 10 a second, show the whole tour of the
    /// camera, 40 s for each room. With another [`frame_rate`](Self::frame_rate), change the number of
    /// [`frames`](Self::frames) too.
    pub fn building(seed: u64, rooms: usize) -> Self {
        let tour = SECONDS_A_ROOM * rooms as f64;
        let room = Room::Building { rooms };
        let default = Self::default();
        Self { room, seed, strangers: true, frames: (tour * default.frame_rate) as usize, ..default }
    }

    /// A building made from a floor plan and furnished from `seed`, with `frame_rate` frames a second and at most
    /// `most_frames` of them: when these do not suffice for all of the floor, the camera's stops are farther apart,
    /// and in the end some of them are left out. The scene's frame is that of the plan.
    pub fn planned_building(plan: BuildingPlan, seed: u64, frame_rate: f64, most_frames: usize) -> Self {
        let seconds = tour_seconds(&plan, seed, most_frames as f64 / frame_rate);
        let frames = ((seconds * frame_rate).ceil() as usize).min(most_frames);
        Self { plan: Some(plan), seed, strangers: true, frames, frame_rate, ..Self::default() }
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("frames", self.frames as f64, 1.0..=1e6)?;
        check_range("frame_rate", self.frame_rate, 0.1..=1000.0)?;
        check_range("camera_roll", self.camera_roll, -PI..=PI)?;
        check_range("camera_pitch", self.camera_pitch, -FRAC_PI_2..=FRAC_PI_2)?;
        if let Room::Building { rooms } = self.room {
            check_range("rooms", rooms as f64, 2.0..=60.0)?;
        }
        check_range("day", self.day as f64, 0.0..=1000.0)?;
        check_range("people", self.people as f64, 0.0..=2.0)?;
        check_range("event_time", self.event_time.unwrap_or(0.0), 0.0..=1e9)?;
        self.sensor.validate()?;
        self.pose_error.validate()?;
        self.detector.validate()
    }
}

/// A uniformly random rotation (Shoemake, "Uniform random rotations", 1992) and a shift of up to 5 m along
/// each axis, from six values of 0..1.
fn random_pose([u, v, w, x, y, z]: [f64; 6]) -> Pose {
    let (first, second) = ((1.0 - u).sqrt(), u.sqrt());
    let ((sin_v, cos_v), (sin_w, cos_w)) = ((TAU * v).sin_cos(), (TAU * w).sin_cos());
    let rotation = [first * sin_v, first * cos_v, second * sin_w, second * cos_w];
    Pose::new([x, y, z].map(|shift| 10.0 * shift - 5.0), rotation).unwrap_or_default()
}

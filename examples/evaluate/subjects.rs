use std::f64::consts::FRAC_PI_2;

use dymlm::core::{PinholeCamera, Pose, SensorModel};
use dymlm_examples::{AnyError, NamedSequence, SequenceSet, every, named_sequences};
use dymlm_sim::{
    Activity, CameraPath, Room, SceneEvent, SensorConfig, Sequence, SequenceConfig, SequenceType,
};

use crate::Arguments;
use crate::drift::true_poses;
use crate::treatment::Detector;

/// A sequence that maps are built from.
pub(crate) struct Subject {
    /// Name in tables.
    pub(crate) name: String,
    /// The set that it belongs to: figures are averaged over sets.
    pub(crate) set: SequenceSet,
    /// The sequence.
    pub(crate) sequence: Sequence,
    /// The sensor model that the maps are given for its depth camera.
    pub(crate) sensor: SensorModel,
    /// The drifting poses of the frames; the true ones without drift.
    pub(crate) drifting: Vec<Pose>,
    /// The frames in which the detector runs: one row of the table for each.
    pub(crate) detectors: Vec<Detector>,
}

impl Subject {
    pub(crate) fn new(named: NamedSequence, every_nth: usize) -> Result<Self, AnyError> {
        let sequence = Sequence::new(&every(named.config, every_nth))?;
        Ok(Self::of(sequence, named.name, named.set, SensorModel::default()))
    }

    /// Also maps with a detector that runs this many times a second, in every n-th of this sequence's frames.
    pub(crate) fn add_slow_detector(&mut self, rate: f64) -> Result<(), AnyError> {
        let frame_rate = self.sequence.config().frame_rate;
        if !(rate > 0.0 && rate <= frame_rate) {
            let name = &self.name;
            return Err(format!(
                "--detector-rate {rate} is outside its range: {name} has {frame_rate} frames a second"
            )
            .into());
        }
        self.detectors.push(Detector::EveryNth((frame_rate / rate).round() as usize));
        Ok(())
    }

    fn of(sequence: Sequence, name: String, set: SequenceSet, sensor: SensorModel) -> Self {
        let (drifting, detectors) = (true_poses(&sequence), vec![Detector::EveryFrame]);
        Self { name, set, sequence, sensor, drifting, detectors }
    }
}

/// The eight sequences, the second room, and random rooms.
pub(crate) fn chosen(arguments: &Arguments) -> Result<Vec<Subject>, AnyError> {
    let first = arguments.first_room;
    let rooms = first..first.saturating_add(arguments.random_rooms);
    let subjects = named_sequences(rooms).into_iter().map(|mut named| {
        if arguments.detector_rate.is_some() {
            let ratio = FAST_FRAME_RATE / named.config.frame_rate;
            named.config.frames = (named.config.frames as f64 * ratio).round() as usize;
            named.config.frame_rate = FAST_FRAME_RATE;
        }
        Subject::new(named, arguments.every)
    });
    subjects.collect()
}

/// Frames a second of a camera that is faster than the detector.
pub(crate) const FAST_FRAME_RATE: f64 = 30.0;

/// `walking_xyz` as seen by other depth cameras, each with its own sensor model: other noise, other sizes of
/// image (the largest with every second pixel of every second row used), a wide angle, and the camera on its
/// side.
pub(crate) fn sensors(every_nth: usize) -> Result<Vec<Subject>, AnyError> {
    let camera = |width: usize, height: usize, focal_length: f64| {
        let [cx, cy] = [width, height].map(|side| (side as f64 - 1.0) / 2.0);
        PinholeCamera::new(width, height, focal_length, focal_length, cx, cy).map(Some)
    };
    let base = SequenceType::WalkingXyz.config();
    let changed = |change: &dyn Fn(&mut SequenceConfig)| {
        let mut config = base.clone();
        change(&mut config);
        config
    };
    let wide = 320.0 / 55.0_f64.to_radians().tan();
    let (small, large, wide) = (camera(320, 240, 262.5)?, camera(1280, 720, 920.0)?, camera(640, 480, wide)?);
    let kinect = SensorModel::kinect();
    let sensors = [
        ("kinect", base.clone(), kinect),
        (
            "stereo (D435)",
            changed(&|config| config.sensor = SensorConfig::realsense_d435()),
            SensorModel::realsense_d4xx(),
        ),
        (
            "time of flight",
            changed(&|config| config.sensor = SensorConfig::time_of_flight()),
            SensorModel::time_of_flight(),
        ),
        ("320x240", changed(&|config| config.camera = small), kinect),
        ("1280x720, stride 2", changed(&|config| config.camera = large), SensorModel { stride: 2, ..kinect }),
        ("110 degrees of view", changed(&|config| config.camera = wide), kinect),
        ("rolled by 90 degrees", changed(&|config| config.camera_roll = FRAC_PI_2), kinect),
    ];
    let subjects = sensors.into_iter().map(|(name, config, sensor)| {
        let sequence = Sequence::new(&every(config, every_nth))?;
        Ok(Subject::of(sequence, name.to_owned(), SequenceSet::Sensors, sensor))
    });
    subjects.collect()
}

/// Sequences with people or things that move and are never detected, in known rooms or in fresh ones.
pub(crate) fn undetected(fresh: Option<u64>, every_nth: usize) -> Result<Vec<Subject>, AnyError> {
    use SceneEvent::{Door, PlacedPartition, PushedChair, RemovedPartition, Trolley};
    /// Name, room, activity, number of people, how many of them are overlooked, events.
    type Design = (&'static str, Room, Activity, usize, usize, &'static [SceneEvent]);
    let all: [Design; 9] = [
        ("nobody detected, walking", Room::Office, Activity::Walking, 2, 2, &[]),
        ("nobody detected, sitting", Room::Office, Activity::Sitting, 2, 2, &[]),
        ("one of two detected", Room::Random, Activity::Walking, 2, 1, &[]),
        ("trolley", Room::Office, Activity::Sitting, 1, 0, &[Trolley]),
        ("trolley, one walks", Room::Random, Activity::Walking, 1, 0, &[Trolley]),
        ("door", Room::Random, Activity::Sitting, 1, 0, &[Door]),
        ("chair", Room::Office, Activity::Walking, 1, 0, &[PushedChair]),
        ("partition comes", Room::Random, Activity::Walking, 1, 0, &[PlacedPartition]),
        ("partition goes", Room::Random, Activity::Walking, 1, 0, &[RemovedPartition]),
    ];
    let subjects = (0..).zip(all).map(|(index, (name, room, activity, people, overlooked, events))| {
        let of_seed = |seed: u64| {
            let mut config = SequenceConfig::random_room(seed);
            if room != Room::Random && fresh.is_none() {
                (config.room, config.world_from_scene) = (room, Pose::identity());
            }
            config.path = PATHS[index % PATHS.len()];
            (config.activity, config.people) = (activity, people);
            config.detector.overlooked_people = overlooked;
            (config.events, config.strangers) = (events.to_vec(), fresh.is_some());
            config
        };
        // In many rooms there is no place for an event, and few have a door that the camera sees open.
        let first = fresh.map_or(KNOWN_SEEDS[index], |seed| 100 * (1000 * seed + index as u64));
        let hundreds = (0..10).map(|hundred| first.wrapping_add(hundred * FAR_SEED));
        let seeds = hundreds.flat_map(|from| (0..100).map(move |place| from.wrapping_add(place)));
        let config = seeds.map(of_seed).find(|config| Sequence::new(config).is_ok());
        let config = config.ok_or_else(|| format!("{name}: no place in a thousand rooms"))?;
        let sequence = Sequence::new(&every(config, every_nth))?;
        Ok(Subject::of(sequence, name.to_owned(), SequenceSet::Undetected, SensorModel::default()))
    });
    subjects.collect()
}

const PATHS: [CameraPath; 4] =
    [CameraPath::HalfSphere, CameraPath::Xyz, CameraPath::Handheld, CameraPath::Rpy];
/// Distance between seeds of which neither's rooms are another's.
const FAR_SEED: u64 = 1 << 48;
/// Seeds with which the events are well in view.
const KNOWN_SEEDS: [u64; 9] = [18, 2, 22, 4, 5, 6, 7, 8, 9];

/// Nine sequences drawn from a seed, with other people in other rooms: three of each activity.
pub(crate) fn fresh(seed: u64, every_nth: usize) -> Result<Vec<Subject>, AnyError> {
    let kinds = [
        (Activity::Sitting, SequenceSet::FreshSitting, "sitting"),
        (Activity::AtDesks, SequenceSet::FreshSitting, "at_desks"),
        (Activity::Walking, SequenceSet::FreshWalking, "walking"),
    ];
    let sequences = (0..9_u64).zip(kinds.into_iter().cycle()).map(|(index, (activity, set, name))| {
        let mut config = SequenceConfig::random_room(1_000_000 + 1000 * seed + index);
        (config.activity, config.strangers) = (activity, true);
        // In the office, people also sit at desks.
        if index == 1 {
            config.room = Room::Office;
        }
        Subject::new(NamedSequence { name: format!("fresh_{seed}_{name}_{index}"), config, set }, every_nth)
    });
    sequences.collect()
}

/// A camera's tour through a floor of a building.
pub(crate) fn building(arguments: &Arguments, seed: u64) -> Result<Subject, AnyError> {
    let mut config = SequenceConfig::building(seed, arguments.rooms);
    config.frames = (config.frames as f64 * arguments.rate / config.frame_rate).round() as usize;
    config.frame_rate = arguments.rate;
    hold_camera(arguments, &mut config);
    let name = format!("building_{seed}_{}_rooms", arguments.rooms);
    Subject::new(NamedSequence { name, config, set: SequenceSet::Building }, arguments.every)
}

/// How the camera is held on its tour.
pub(crate) fn hold_camera(arguments: &Arguments, config: &mut SequenceConfig) {
    config.camera_pitch = arguments.pitch.to_radians();
    config.camera_roll = arguments.roll.to_radians();
    if arguments.robot {
        config.path = CameraPath::Robot;
    }
}

/// Frames of a quick sequence: 8 s, of which every second frame is taken.
const QUICK_FRAMES: usize = 80;

/// Two short sequences, one of each activity.
pub(crate) fn quick() -> Result<Vec<Subject>, AnyError> {
    let quick = [SequenceType::WalkingHalfSphere, SequenceType::SittingXyz].map(SequenceType::name);
    let sequences = named_sequences(0..0).into_iter().filter(|named| quick.contains(&named.name.as_str()));
    let subjects = sequences.map(|mut named| {
        named.config.frames = QUICK_FRAMES;
        Subject::new(named, 2)
    });
    subjects.collect()
}

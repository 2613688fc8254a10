use std::f64::consts::FRAC_PI_2;

use dymlm::core::{PinholeCamera, SensorModel};
use dymlm_examples::{AnyError, NamedSequence, SequenceSet, every, named_sequences};
use dymlm_sim::{PoseErrorConfig, SensorConfig, Sequence, SequenceConfig, SequenceType};

use crate::Arguments;

/// A sequence that maps are built from.
pub(crate) struct Subject {
    /// Name in tables.
    pub(crate) name: String,
    /// Which set it belongs to: figures are averaged over sets.
    pub(crate) set: SequenceSet,
    /// The sequence.
    pub(crate) sequence: Sequence,
    /// What the maps are told of its depth camera.
    pub(crate) sensor: SensorModel,
}

impl Subject {
    fn new(named: NamedSequence, every_nth: usize) -> Result<Self, AnyError> {
        let sequence = Sequence::new(&every(named.config, every_nth))?;
        Ok(Self { name: named.name, set: named.set, sequence, sensor: SensorModel::default() })
    }
}

/// The eight sequences, the second room, and random rooms.
pub(crate) fn chosen(arguments: &Arguments) -> Result<Vec<Subject>, AnyError> {
    let subjects = named_sequences(arguments.random_rooms).into_iter().map(|mut named| {
        if arguments.detector_rate.is_some() {
            let ratio = FAST_FRAME_RATE / named.config.frame_rate;
            named.config.frames = (named.config.frames as f64 * ratio).round() as usize;
            named.config.frame_rate = FAST_FRAME_RATE;
        }
        if arguments.pose_noise {
            named.config.pose_error = PoseErrorConfig::slam();
        }
        Subject::new(named, arguments.every)
    });
    subjects.collect()
}

/// Frames a second of a camera that is faster than the detector.
pub(crate) const FAST_FRAME_RATE: f64 = 30.0;

/// `walking_xyz` as other depth cameras see it, each with its own model: other noise, other sizes of image
/// (the largest with every second pixel of every second row used), a wide angle, and the camera on its side.
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
        Ok(Subject { name: name.to_owned(), set: SequenceSet::Sensors, sequence, sensor })
    });
    subjects.collect()
}

/// Frames of a quick sequence, 8 s of which every second is taken.
const QUICK_FRAMES: usize = 80;

/// Two short sequences, one of each activity.
pub(crate) fn quick() -> Result<Vec<Subject>, AnyError> {
    let quick = [SequenceType::WalkingHalfSphere, SequenceType::SittingXyz].map(SequenceType::name);
    let sequences = named_sequences(0).into_iter().filter(|named| quick.contains(&named.name.as_str()));
    let subjects = sequences.map(|mut named| {
        named.config.frames = QUICK_FRAMES;
        Subject::new(named, 2)
    });
    subjects.collect()
}

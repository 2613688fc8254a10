use dymlm_core::{ConfigError, PinholeCamera, Pose, check_range};

use crate::{CameraPath, DetectorConfig, SensorConfig};

/// What a [`Sequence`](crate::Sequence) shows.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SequenceConfig {
    /// Number of frames, 1..=1000000, default 150: 15 s.
    pub frames: usize,
    /// Frames a second, 0.1..=1000, default 10.
    pub frame_rate: f64,
    /// Seed of all that is random: noise, the detector's failures, the people's start and speed. Default 7.
    pub seed: u64,
    /// The camera. Default `None`: 640x480, f = 525 px, principal point in the middle (a Kinect).
    pub camera: Option<PinholeCamera>,
    /// How the camera moves. Default [`CameraPath::Handheld`].
    pub path: CameraPath,
    /// Where the room stands in the world; in its own frame z is up and the floor is z = 0. Default identity.
    /// A tilted world shows whether a map depends on which way is up.
    pub world_from_scene: Pose,
    /// Number of people who walk, 0..=2, default 2.
    pub people: usize,
    /// The depth camera's errors.
    pub sensor: SensorConfig,
    /// The detector's errors.
    pub detector: DetectorConfig,
}

impl Default for SequenceConfig {
    fn default() -> Self {
        Self {
            frames: 150,
            frame_rate: 10.0,
            seed: 7,
            camera: None,
            path: CameraPath::default(),
            world_from_scene: Pose::identity(),
            people: 2,
            sensor: SensorConfig::default(),
            detector: DetectorConfig::default(),
        }
    }
}

impl SequenceConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("frames", self.frames as f64, 1.0..=1e6)?;
        check_range("frame_rate", self.frame_rate, 0.1..=1000.0)?;
        check_range("people", self.people as f64, 0.0..=2.0)?;
        self.sensor.validate()?;
        self.detector.validate()
    }
}

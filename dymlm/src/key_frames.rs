use dymlm_core::{ConfigError, Pose, check_range};

/// Which frames are mapped. The others are only tracked, so that movers are followed without gaps.
///
/// A frame is a key frame when the camera has moved by either amount since the last one; an amount of 0 does
/// not count. By default both are 0 and every frame is mapped: right for callers that hand in their SLAM's
/// key frames, or all frames at a rate that one core keeps up with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct KeyFrameConfig {
    /// Translation since the last key frame, metres, 0..=100. Default 0: does not count.
    pub min_translation: f64,
    /// Rotation since the last key frame, radians, 0..=3.15. Default 0: does not count.
    pub min_rotation: f64,
}

/// Chooses key frames by the camera's motion.
#[derive(Debug, Clone)]
pub(crate) struct KeyFrames {
    config: KeyFrameConfig,
    last: Option<Pose>,
}

impl KeyFrames {
    pub(crate) fn new(config: KeyFrameConfig) -> Result<Self, ConfigError> {
        check_range("key_frames.min_translation", config.min_translation, 0.0..=100.0)?;
        check_range("key_frames.min_rotation", config.min_rotation, 0.0..=3.15)?;
        Ok(Self { config, last: None })
    }

    /// Whether the frame seen from here is to be mapped; if so it is the last key frame from now on.
    pub(crate) fn choose(&mut self, world_from_camera: &Pose) -> bool {
        let KeyFrameConfig { min_translation, min_rotation } = self.config;
        let every_frame = min_translation == 0.0 && min_rotation == 0.0;
        let moved = |by: f64, least: f64| least > 0.0 && by >= least;
        let chosen = every_frame
            || self.last.is_none_or(|last| {
                moved(world_from_camera.distance(&last), min_translation)
                    || moved(world_from_camera.angle(&last), min_rotation)
            });
        if chosen {
            self.last = Some(*world_from_camera);
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Pose {
        Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
    }

    #[test]
    fn by_default_every_frame_is_one() {
        let mut key_frames = KeyFrames::new(KeyFrameConfig::default()).unwrap();
        assert!((0..3).all(|_| key_frames.choose(&Pose::identity())));
    }

    #[test]
    fn motion_is_measured_from_the_last_key_frame() {
        let config = KeyFrameConfig { min_translation: 0.1, ..KeyFrameConfig::default() };
        let mut key_frames = KeyFrames::new(config).unwrap();
        let chosen = [0.0, 0.06, 0.11, 0.16, 0.22].map(|x| key_frames.choose(&at(x)));
        assert_eq!(chosen, [true, false, true, false, true]);
    }

    #[test]
    fn either_motion_is_enough() {
        let config = KeyFrameConfig { min_translation: 5.0, min_rotation: 0.5 };
        let mut key_frames = KeyFrames::new(config).unwrap();
        assert!(key_frames.choose(&at(0.0)));
        assert!(!key_frames.choose(&at(1.0)));
        let turned = Pose::new([0.0; 3], [0.0, 0.0, 0.3_f64.sin(), 0.3_f64.cos()]).unwrap();
        assert!(key_frames.choose(&turned));
    }

    #[test]
    fn refuses_motions_that_are_none() {
        let config = KeyFrameConfig { min_translation: f64::NAN, ..KeyFrameConfig::default() };
        assert_eq!(KeyFrames::new(config).unwrap_err().field, "key_frames.min_translation");
    }
}

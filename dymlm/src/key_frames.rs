#[cfg(feature = "serde")]
use dymlm_core::null_is_infinite;
use dymlm_core::{ConfigError, Pose, check_range};

/// Which frames are mapped. The others are only tracked, so that movers are followed without gaps.
///
/// A frame is a key frame when the camera has moved by either amount since the last one, or when the interval
/// has passed: a robot at rest goes on to see what changes, at a fraction of the cost. An amount of 0 maps
/// every frame ([`every_frame`](Self::every_frame)), an infinite one (in JSON: null) is never reached.
///
/// Where the detector does not run on every frame, those on which it ran are in addition chosen by the same
/// rule among themselves: no object goes unseen because other frames were the key frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct KeyFrameConfig {
    /// Translation since the last key frame, metres, at least 0. Default 0.02: a hand-held camera is mapped
    /// ten times a second, about.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "null_is_infinite"))]
    pub min_translation: f64,
    /// Rotation since the last key frame, radians, at least 0. Default 1 degree: 3 cm at 2 m.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "null_is_infinite"))]
    pub min_rotation: f64,
    /// Time since the last key frame, seconds, at least 0. Default 0.2: it takes seconds anyway to tell what
    /// moves in front of a camera at rest from what stands.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "null_is_infinite"))]
    pub max_interval: f64,
}

impl Default for KeyFrameConfig {
    fn default() -> Self {
        Self { min_translation: 0.02, min_rotation: 1_f64.to_radians(), max_interval: 0.2 }
    }
}

impl KeyFrameConfig {
    /// Every frame is mapped: for recordings that are mapped after the fact at any cost, and for callers that
    /// have chosen key frames themselves.
    #[must_use]
    pub fn every_frame() -> Self {
        Self { max_interval: 0.0, ..Self::default() }
    }

    /// Whether a frame is far enough from the last key frame, in space or time. `period`: the time between
    /// frames; the frame nearest to the end of the interval is chosen, whatever the jitter of their times.
    fn is_due(&self, last: &Viewed, new: &Viewed, period: f64) -> bool {
        new.world_from_camera.distance(&last.world_from_camera) >= self.min_translation
            || new.world_from_camera.angle(&last.world_from_camera) >= self.min_rotation
            || new.timestamp - last.timestamp + 0.5 * period >= self.max_interval
    }
}

/// Chooses key frames by the camera's motion and by time.
#[derive(Debug, Clone)]
pub(crate) struct KeyFrames {
    config: KeyFrameConfig,
    /// Time of the last frame, seconds.
    newest: f64,
    last: Option<Viewed>,
    /// The last key frame on which the detector ran.
    last_detected: Option<Viewed>,
}

/// Time and pose of a frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Viewed {
    pub(crate) timestamp: f64,
    pub(crate) world_from_camera: Pose,
}

impl KeyFrames {
    pub(crate) fn new(config: KeyFrameConfig) -> Result<Self, ConfigError> {
        let amounts = [
            ("key_frames.min_translation", config.min_translation),
            ("key_frames.min_rotation", config.min_rotation),
            ("key_frames.max_interval", config.max_interval),
        ];
        for (field, amount) in amounts {
            check_range(field, amount, 0.0..=f64::INFINITY)?;
        }
        Ok(Self { config, newest: f64::NEG_INFINITY, last: None, last_detected: None })
    }

    /// Moves the noted poses with the world.
    pub(crate) fn move_world(&mut self, new_from_old: &Pose) {
        for viewed in self.last.iter_mut().chain(&mut self.last_detected) {
            viewed.world_from_camera = *new_from_old * viewed.world_from_camera;
        }
    }

    /// Whether a frame is to be mapped; if so it becomes the last key frame.
    pub(crate) fn choose(&mut self, frame: Viewed, is_detected: bool) -> bool {
        let period = frame.timestamp - std::mem::replace(&mut self.newest, frame.timestamp);
        let is_due = |last: Option<Viewed>| last.is_none_or(|last| self.config.is_due(&last, &frame, period));
        let chosen = is_due(self.last) || is_detected && is_due(self.last_detected);
        if chosen {
            self.last = Some(frame);
            self.last_detected = if is_detected { self.last } else { self.last_detected };
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(timestamp: f64, x: f64) -> Viewed {
        let world_from_camera = Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        Viewed { timestamp, world_from_camera }
    }

    #[test]
    fn every_frame_means_every_frame() {
        let mut key_frames = KeyFrames::new(KeyFrameConfig::every_frame()).unwrap();
        assert!((0..3).all(|_| key_frames.choose(at(0.0, 0.0), true)));
    }

    #[test]
    fn motion_is_measured_from_the_last_key_frame() {
        let mut key_frames = KeyFrames::new(KeyFrameConfig::default()).unwrap();
        let chosen = [0.0, 0.015, 0.021, 0.04, 0.05].map(|x| key_frames.choose(at(0.0, x), true));
        assert_eq!(chosen, [true, false, true, false, true]);
    }

    #[test]
    fn either_motion_is_enough() {
        let config = KeyFrameConfig { min_translation: 5.0, min_rotation: 0.5, max_interval: 10.0 };
        let mut key_frames = KeyFrames::new(config).unwrap();
        assert!(key_frames.choose(at(0.0, 0.0), true));
        assert!(!key_frames.choose(at(0.0, 1.0), true));
        let turned = Pose::new([0.0; 3], [0.0, 0.0, 0.3_f64.sin(), 0.3_f64.cos()]).unwrap();
        assert!(key_frames.choose(Viewed { timestamp: 0.0, world_from_camera: turned }, true));
    }

    #[test]
    fn at_rest_time_chooses_at_any_rate() {
        for rate in [1.0, 5.0, 30.0, 200.0] {
            let mut key_frames = KeyFrames::new(KeyFrameConfig::default()).unwrap();
            let jitter = |step: u32| f64::from(step * 7919 % 11) * 0.01 / rate;
            let times = (0..(60.0 * rate) as u32).map(|step| f64::from(step) / rate + jitter(step));
            let chosen = times.filter(|&time| key_frames.choose(at(time, 0.0), true)).count();
            let expected = 60.0 * f64::min(rate, 5.0);
            assert!((chosen as f64 - expected).abs() <= 0.05 * expected, "{chosen} at {rate} Hz");
        }
    }

    #[test]
    fn a_slow_detector_is_heard_whatever_its_phase() {
        for phase in 0..6 {
            let mut key_frames = KeyFrames::new(KeyFrameConfig::default()).unwrap();
            let is_detected = |step: u32| step % 6 == phase;
            let heard = (0..300_u32).filter(|&step| {
                key_frames.choose(at(f64::from(step) / 30.0, 0.0), is_detected(step)) && is_detected(step)
            });
            assert!(heard.count() >= 24, "of 50 runs at 5 Hz, phase {phase}");
        }
    }

    #[test]
    fn refuses_amounts_that_are_none() {
        for amount in [f64::NAN, -1.0] {
            let config = KeyFrameConfig { min_translation: amount, ..KeyFrameConfig::default() };
            assert_eq!(KeyFrames::new(config).unwrap_err().field, "key_frames.min_translation");
        }
        let motion_alone = KeyFrameConfig { max_interval: f64::INFINITY, ..KeyFrameConfig::default() };
        let mut key_frames = KeyFrames::new(motion_alone).unwrap();
        assert_eq!([0.0, 1e6].map(|time| key_frames.choose(at(time, 0.0), true)), [true, false]);
    }
}

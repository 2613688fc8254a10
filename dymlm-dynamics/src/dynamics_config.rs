use dymlm_core::{ConfigError, check_range};

use crate::{MaskConfig, TrackerConfig};

/// Settings of [`Preprocessor`](crate::Preprocessor).
///
/// By default every step is on. Plain systems are settings too: `tracker.max_coast = 0`, `max_extension = 0`
/// and `mask.mode = MaskMode::Box` mask each box exactly as the detector gives it.
///
/// ```
/// use dymlm_core::SensorModel;
/// use dymlm_dynamics::{DynamicsConfig, MaskMode, Preprocessor};
///
/// let mut raw_boxes = DynamicsConfig::default();
/// raw_boxes.tracker.max_coast = 0.0;
/// raw_boxes.max_extension = 0.0;
/// raw_boxes.mask.mode = MaskMode::Box;
/// assert!(Preprocessor::new(raw_boxes, SensorModel::kinect()).is_ok());
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct DynamicsConfig {
    /// COCO classes that are potential movers besides person and the animals, which always are; default none.
    /// A name that is not a COCO class is refused.
    pub mover_labels: Vec<String>,
    /// Potential movers among a detector's own classes; any name is accepted; default none.
    pub own_mover_labels: Vec<String>,
    /// Tracking of boxes.
    pub tracker: TrackerConfig,
    /// Largest distance by which a side moves outward when the box cuts its mover short, in pixels of a
    /// 640x480 image (other images: in proportion); 0..=640, default 50 (the paper's); 0 = boxes stay as they
    /// are.
    pub max_extension: f32,
    /// The static mask.
    pub mask: MaskConfig,
}

impl Default for DynamicsConfig {
    fn default() -> Self {
        Self {
            mover_labels: Vec::new(),
            own_mover_labels: Vec::new(),
            tracker: TrackerConfig::default(),
            max_extension: 50.0,
            mask: MaskConfig::default(),
        }
    }
}

impl DynamicsConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("dynamics.max_extension", self.max_extension.into(), 0.0..=640.0)?;
        self.mask.validate()
    }
}

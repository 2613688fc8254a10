use crate::{CompensationConfig, CorrectionConfig, ForegroundConfig, MaskConfig, TrackerConfig};

/// Settings of [`Preprocessor`](crate::Preprocessor), one part a step.
///
/// The default does all that can be done. Plain systems are settings too: every box a detector gives, as it is, is
/// `tracker.max_coast = 0`, `correction.max_extension = 0` and `mask.mode = MaskMode::Box`.
///
/// ```
/// use dymlm_dynamics::{DynamicsConfig, MaskMode, Preprocessor};
///
/// let mut raw_boxes = DynamicsConfig::default();
/// raw_boxes.tracker.max_coast = 0.0;
/// raw_boxes.correction.max_extension = 0.0;
/// raw_boxes.mask.mode = MaskMode::Box;
/// assert!(Preprocessor::new(raw_boxes).is_ok());
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct DynamicsConfig {
    /// Labels of potential movers; default: person and the animals of COCO. Detections of all others are passed over.
    pub mover_labels: Vec<String>,
    /// Tracking of boxes.
    pub tracker: TrackerConfig,
    /// Foreground of a box.
    pub foreground: ForegroundConfig,
    /// Compensation of missed detections.
    pub compensation: CompensationConfig,
    /// Correction of boxes.
    pub correction: CorrectionConfig,
    /// The static mask.
    pub mask: MaskConfig,
}

/// Person and the animals among the classes of COCO.
const COCO_MOVERS: [&str; 11] =
    ["person", "bird", "cat", "dog", "horse", "sheep", "cow", "elephant", "bear", "zebra", "giraffe"];

impl Default for DynamicsConfig {
    fn default() -> Self {
        Self {
            mover_labels: COCO_MOVERS.map(String::from).to_vec(),
            tracker: TrackerConfig::default(),
            foreground: ForegroundConfig::default(),
            compensation: CompensationConfig::default(),
            correction: CorrectionConfig::default(),
            mask: MaskConfig::default(),
        }
    }
}

use dymlm::core::{ConfigError, check_range};

use crate::COCO_NAMES;

/// Thresholds and class names for a network's boxes.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct YoloxConfig {
    /// Least score of a detection, 0..=1. Default 0.25, as in YOLO's tools. A lower value gives more false
    /// boxes; the tracking uses weak boxes only for movers that it follows already.
    pub min_score: f32,
    /// Intersection over union above which the weaker of two boxes of one class is removed, 0..=1. Default
    /// 0.45, as in YOLOX's demonstration.
    pub max_overlap: f64,
    /// Names of the classes in the order of their numbers. Default: COCO's 80.
    pub class_names: Vec<String>,
}

impl Default for YoloxConfig {
    fn default() -> Self {
        Self { min_score: 0.25, max_overlap: 0.45, class_names: COCO_NAMES.map(String::from).to_vec() }
    }
}

impl YoloxConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("detector.min_score", f64::from(self.min_score), 0.0..=1.0)?;
        check_range("detector.max_overlap", self.max_overlap, 0.0..=1.0)
    }
}

use dymlm_core::{ConfigError, check_range};

/// What counts as the same object.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ObjectScoreConfig {
    /// Least intersection over union of the boxes' volumes, 0.01..=1, default 0.25: the threshold of the `ScanNet` and
    /// SUN RGB-D benchmarks.
    pub min_iou: f64,
    /// Frames that must have seen an object before a map is asked for it, 1..=1000000, default 8.
    pub min_frames: u32,
}

impl Default for ObjectScoreConfig {
    fn default() -> Self {
        Self { min_iou: 0.25, min_frames: 8 }
    }
}

impl ObjectScoreConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("object_score.min_iou", self.min_iou, 0.01..=1.0)?;
        check_range("object_score.min_frames", self.min_frames.into(), 1.0..=1e6)
    }
}

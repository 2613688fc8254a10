use dymlm_core::{ConfigError, check_range};

/// Settings of [`PlaneDetector`](super::PlaneDetector). Lengths in pixels refer to a camera with a focal
/// length of 525 pixels (a Kinect at 640x480); they scale with the camera's focal length.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct PlaneDetectorConfig {
    /// Side of a block, pixels, 4..=64. Default 8. Larger blocks are faster; but with Feng's 10, narrow faces
    /// such as a seat or a desk's side seen at 70 degrees do not hold two whole blocks side by side.
    pub block_size: usize,
    /// Least pixels of a plane, 10..=1000000. Default 500: a face of 0.08 m2 at 3 m seen at 75 degrees. (Feng
    /// 2014: 3000.)
    pub min_support: usize,
    /// Least area of a plane, square metres, 0..=100. Default 0.05: a chair's seat of which a person leaves a
    /// quarter visible; smaller ones are mostly pieces of round things.
    pub min_area: f64,
    /// Largest share of a plane's pixels in the movers' boxes, 0..=1. Default 1, no limit: the mask already
    /// excludes the movers' pixels, and the remaining pixels in a box mostly show what stands behind. With
    /// 0.7 a map of people who sit lacks the chairs and the walls around them and gains nothing (recall of
    /// faces on the eight synthetic sequences 75 instead of 87 %, precision the same). Lower it where masks
    /// leave out parts of movers.
    pub max_mover_overlap: f64,
}

impl Default for PlaneDetectorConfig {
    fn default() -> Self {
        Self { block_size: 8, min_support: 500, min_area: 0.05, max_mover_overlap: 1.0 }
    }
}

impl PlaneDetectorConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("planes.detector.block_size", self.block_size as f64, 4.0..=64.0)?;
        check_range("planes.detector.min_support", self.min_support as f64, 10.0..=1e6)?;
        check_range("planes.detector.min_area", self.min_area, 0.0..=100.0)?;
        check_range("planes.detector.max_mover_overlap", self.max_mover_overlap, 0.0..=1.0)
    }
}

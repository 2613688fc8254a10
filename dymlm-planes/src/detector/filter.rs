use dymlm_core::BoundingBox;

use super::config::PlaneDetectorConfig;
use super::detected_plane::DetectedPlane;
use super::extraction::Extraction;

/// Why a detected plane was rejected.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RejectionCause {
    /// Too large a share of it lies in the movers' boxes.
    Mover {
        /// The share of its pixels in the boxes.
        overlap: f64,
    },
    /// It is too small.
    Area {
        /// Its area, square metres.
        area: f64,
    },
    /// The direction of its normal is too uncertain.
    Uncertain {
        /// Standard deviation of the direction, radians.
        angle_deviation: f64,
    },
}

/// A detected plane that the filter kept out of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RejectedPlane {
    /// The label of its pixels.
    pub label: u16,
    /// Why it was rejected.
    pub cause: RejectionCause,
}

/// Largest standard deviation of the normal's direction, radians: 3 degrees. Without the rule half a plane
/// more per room is mapped, and a false one in 200; planes are 0.1 mm worse.
const MAX_ANGLE_DEVIATION: f64 = 0.052;

/// Rejects planes that are too small, too uncertain, or on a mover (paper III-B).
///
/// Masked pixels of movers are never part of a plane; this filter drops what the mask missed. O(pixels in
/// boxes).
#[derive(Debug, Clone)]
pub(super) struct PlaneFilter {
    min_area: f64,
    max_mover_overlap: f64,
    /// Number of pixels of each label in the boxes.
    in_boxes: Vec<usize>,
    rejected: Vec<RejectedPlane>,
}

impl PlaneFilter {
    pub(super) fn new(config: &PlaneDetectorConfig) -> Self {
        let PlaneDetectorConfig { min_area, max_mover_overlap, .. } = *config;
        Self { min_area, max_mover_overlap, in_boxes: Vec::new(), rejected: Vec::new() }
    }

    /// Rejects planes that do not pass, each with the first cause that applies. `movers` are the corrected
    /// boxes of potential movers, pixels.
    pub(super) fn filter(
        &mut self,
        planes: &mut Vec<DetectedPlane>,
        extraction: &Extraction,
        movers: &[BoundingBox],
    ) {
        self.count_in_boxes(extraction, movers);
        self.rejected.clear();
        planes.retain(|plane| match self.cause_against(plane) {
            None => true,
            Some(cause) => {
                self.rejected.push(RejectedPlane { label: plane.label, cause });
                false
            }
        });
    }

    /// The planes that the last call rejected.
    pub(super) fn rejected(&self) -> &[RejectedPlane] {
        &self.rejected
    }

    /// Counts each label's pixels in the union of the boxes.
    fn count_in_boxes(&mut self, extraction: &Extraction, movers: &[BoundingBox]) {
        let (width, height) = (extraction.width(), extraction.height());
        self.in_boxes.clear();
        self.in_boxes.resize(extraction.segments().len() + 1, 0);
        for (index, mover) in movers.iter().enumerate() {
            let earlier = &movers[..index];
            for v in mover.rows(height) {
                for u in mover.columns(width) {
                    let counted = earlier
                        .iter()
                        .any(|other| other.rows(height).contains(&v) && other.columns(width).contains(&u));
                    if !counted {
                        self.in_boxes[usize::from(extraction.labels()[v * width + u])] += 1;
                    }
                }
            }
        }
    }

    fn cause_against(&self, plane: &DetectedPlane) -> Option<RejectionCause> {
        let in_boxes = self.in_boxes.get(usize::from(plane.label)).copied().unwrap_or(0);
        let overlap = in_boxes as f64 / plane.support.max(1) as f64;
        if overlap > self.max_mover_overlap {
            return Some(RejectionCause::Mover { overlap });
        }
        if plane.area < self.min_area {
            return Some(RejectionCause::Area { area: plane.area });
        }
        let angle_deviation = plane.covariance.angle_deviation();
        (angle_deviation > MAX_ANGLE_DEVIATION).then_some(RejectionCause::Uncertain { angle_deviation })
    }
}

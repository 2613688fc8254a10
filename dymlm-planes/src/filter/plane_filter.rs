use dymlm_core::BoundingBox;

use super::FilterConfig;
use crate::PlaneError;
use crate::extraction::Extraction;
use crate::refinement::DetectedPlane;

/// Why a detected plane is kept from the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RejectionCause {
    /// Its mean depth is out of range.
    Depth {
        /// The mean depth, metres.
        depth: f64,
    },
    /// Too few of its pixels are inliers.
    InlierRatio {
        /// The share of inliers.
        ratio: f64,
    },
    /// Too much of it lies in the movers' boxes.
    Mover {
        /// The share of its pixels that does.
        overlap: f64,
    },
    /// It is too small.
    Area {
        /// Its area, square metres.
        area: f64,
    },
    /// Its normal is too uncertain.
    Uncertain {
        /// Standard deviation of its direction, radians.
        angle_deviation: f64,
    },
}

/// A detected plane that was kept from the map.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct RejectedPlane {
    /// Index of its segment in the extraction.
    pub segment: usize,
    /// Why.
    pub cause: RejectionCause,
}

/// Keeps planes from the map that are too far, too ragged, too uncertain, or on a mover (paper III-B).
///
/// Pixels of the static mask's movers never were part of a plane; what this drops is what the mask has left over.
/// O(pixels in boxes).
#[derive(Debug, Clone)]
pub struct PlaneFilter {
    config: FilterConfig,
    /// Pixels of each segment in boxes.
    covered: Vec<usize>,
    rejected: Vec<RejectedPlane>,
}

impl PlaneFilter {
    /// Makes a filter.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Config`] names the field outside its range.
    pub fn new(config: FilterConfig) -> Result<Self, PlaneError> {
        config.validate()?;
        Ok(Self { config, covered: Vec::new(), rejected: Vec::new() })
    }

    /// Drops planes that do not pass, and returns them with the first cause. `movers` are the corrected boxes of potential movers, pixels.
    pub fn filter(
        &mut self,
        planes: &mut Vec<DetectedPlane>,
        extraction: &Extraction,
        movers: &[BoundingBox],
    ) -> &[RejectedPlane] {
        self.count_covered(extraction, movers);
        self.rejected.clear();
        planes.retain(|plane| match self.cause_against(plane) {
            None => true,
            Some(cause) => {
                self.rejected.push(RejectedPlane { segment: plane.segment, cause });
                false
            }
        });
        &self.rejected
    }

    /// What the last call dropped.
    pub fn rejected(&self) -> &[RejectedPlane] {
        &self.rejected
    }

    /// The config.
    pub fn config(&self) -> &FilterConfig {
        &self.config
    }

    /// Counts each segment's pixels in the union of the boxes.
    fn count_covered(&mut self, extraction: &Extraction, movers: &[BoundingBox]) {
        let (width, height) = (extraction.width(), extraction.height());
        self.covered.clear();
        self.covered.resize(extraction.segments().len() + 1, 0);
        for (index, mover) in movers.iter().enumerate() {
            let earlier = &movers[..index];
            for v in mover.rows(height) {
                for u in mover.columns(width) {
                    let counted = earlier
                        .iter()
                        .any(|other| other.rows(height).contains(&v) && other.columns(width).contains(&u));
                    if !counted {
                        self.covered[usize::from(extraction.labels()[v * width + u])] += 1;
                    }
                }
            }
        }
    }

    fn cause_against(&self, plane: &DetectedPlane) -> Option<RejectionCause> {
        let config = &self.config;
        let depth = plane.centroid[2];
        if !(config.min_depth..=config.max_depth).contains(&depth) {
            return Some(RejectionCause::Depth { depth });
        }
        let ratio = plane.inlier_ratio();
        if ratio < config.min_inlier_ratio {
            return Some(RejectionCause::InlierRatio { ratio });
        }
        let covered = self.covered.get(plane.segment + 1).copied().unwrap_or(0);
        let overlap = covered as f64 / plane.support.max(1) as f64;
        if overlap > config.max_mover_overlap {
            return Some(RejectionCause::Mover { overlap });
        }
        if plane.area < config.min_area {
            return Some(RejectionCause::Area { area: plane.area });
        }
        let angle_deviation = plane.covariance.angle_deviation();
        if angle_deviation > config.max_angle_deviation_deg.to_radians() {
            return Some(RejectionCause::Uncertain { angle_deviation });
        }
        None
    }
}

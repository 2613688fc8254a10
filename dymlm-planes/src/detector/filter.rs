use dymlm_core::{BoundingBox, Mask, SensorModel};

use super::config::PlaneDetectorConfig;
use super::detected_plane::DetectedPlane;
use super::extraction::Extraction;
use super::through_step::through_step;

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
    /// It is narrow, and its rims are so uncertain that it may be a step between two surfaces.
    Step {
        /// Standard deviation of the distance by which its tilt moves its long rims, metres.
        rim_deviation: f64,
    },
    /// It is no surface of its own, but goes through the step between two parallel planes.
    ThroughStep {
        /// Distance between the two planes, metres.
        step: f64,
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

/// Largest standard deviation by which the tilt of a narrow plane moves its long rims, metres. Where it is
/// larger, noise may hide that the plane goes through a step. Without narrow planes recall in buildings is about
/// 1 % lower (frames of doors, mostly); with all of them precision is 4 to 8 % lower.
const MAX_RIM_DEVIATION: f64 = 0.001;

/// Rejects planes that are too small, too uncertain, or on a mover (paper III-B).
///
/// Masked pixels of movers are never part of a plane; this filter drops what the mask missed. O(pixels + rows
/// of the boxes), and nothing per pixel where the overlap has no limit.
#[derive(Debug, Clone)]
pub(super) struct PlaneFilter {
    sensor: SensorModel,
    min_area: f64,
    max_mover_overlap: f64,
    /// The union of the boxes.
    covered: Option<Mask>,
    /// Number of pixels of each label in the boxes.
    in_boxes: Vec<usize>,
    rejected: Vec<RejectedPlane>,
}

impl PlaneFilter {
    pub(super) fn new(config: &PlaneDetectorConfig, sensor: SensorModel) -> Self {
        let PlaneDetectorConfig { min_area, max_mover_overlap, .. } = *config;
        let (in_boxes, rejected) = (Vec::new(), Vec::new());
        Self { sensor, min_area, max_mover_overlap, covered: None, in_boxes, rejected }
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
        for plane in planes.iter() {
            if let Some(cause) = self.cause_against(plane, planes, extraction.is_strip(plane.label)) {
                self.rejected.push(RejectedPlane { label: plane.label, cause });
            }
        }
        planes.retain(|plane| self.rejected.iter().all(|rejected| rejected.label != plane.label));
    }

    /// The planes that the last call rejected.
    pub(super) fn rejected(&self) -> &[RejectedPlane] {
        &self.rejected
    }

    /// Counts each label's pixels in the union of the boxes. Without a limit to the overlap there is nothing
    /// to count, because a plane has no more pixels in the boxes than it has in all.
    fn count_in_boxes(&mut self, extraction: &Extraction, movers: &[BoundingBox]) {
        self.in_boxes.clear();
        self.in_boxes.resize(extraction.segments().len() + 1, 0);
        if movers.is_empty() || self.max_mover_overlap >= 1.0 {
            return;
        }
        let Some(covered) = union_of(movers, &mut self.covered, [extraction.width(), extraction.height()])
        else {
            return;
        };
        for (v, labels) in extraction.labels().chunks_exact(extraction.width()).enumerate() {
            for u in covered.columns_of_row(v) {
                self.in_boxes[usize::from(labels[u])] += 1;
            }
        }
    }

    /// Why a plane of a frame, whose planes are `planes`, is rejected.
    fn cause_against(
        &self,
        plane: &DetectedPlane,
        planes: &[DetectedPlane],
        is_strip: bool,
    ) -> Option<RejectionCause> {
        let in_boxes = self.in_boxes.get(usize::from(plane.label)).copied().unwrap_or(0);
        let overlap = in_boxes as f64 / plane.support.max(1) as f64;
        if overlap > self.max_mover_overlap {
            return Some(RejectionCause::Mover { overlap });
        }
        if plane.area < self.min_area {
            return Some(RejectionCause::Area { area: plane.area });
        }
        let angle_deviation = plane.covariance.angle_deviation();
        if angle_deviation > MAX_ANGLE_DEVIATION {
            return Some(RejectionCause::Uncertain { angle_deviation });
        }
        let rim_deviation = plane.covariance.rim_deviation();
        if is_strip && rim_deviation > MAX_RIM_DEVIATION {
            return Some(RejectionCause::Step { rim_deviation });
        }
        through_step(plane, planes, &self.sensor).map(|step| RejectionCause::ThroughStep { step })
    }
}

/// The pixels of an image of some size that lie in any of the boxes, in the buffer's memory. `None` for an
/// image without pixels.
///
/// Boxes are drawn one after the other, so that their number does not multiply with their pixels: comparing
/// each pixel with all other boxes took 13 s for 400 people.
fn union_of<'a>(boxes: &[BoundingBox], buffer: &'a mut Option<Mask>, size: [usize; 2]) -> Option<&'a Mask> {
    let [width, height] = size;
    let mut covered = match buffer.take() {
        Some(mut mask) => mask.refill(width, height, false).ok().map(|()| mask),
        None => Mask::filled(width, height, false).ok(),
    }?;
    for bounding_box in boxes {
        covered.fill_box(bounding_box, true);
    }
    Some(buffer.insert(covered))
}

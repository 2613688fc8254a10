use dymlm_core::vector3::{Vector3, along, cross, dot, unit};
use dymlm_core::{Point, Pose};

use crate::{Completeness, ObjectObservation, SideView};

/// What one frame has seen of an object, so that poses can be refined with it: its outline as the camera sees
/// it, and how near it is.
///
/// One frame sees one side of a thing, so the mean of its points is no place of the thing: it moves as the
/// camera goes around it. The middle of the outline hardly does: from far away, the outline of a box or an
/// ellipsoid has its middle just before the thing's centre, whichever side shows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ObjectSighting {
    /// Time of the frame, seconds.
    pub timestamp: f64,
    /// The frame's pose.
    pub world_from_camera: Pose,
    /// Unit vector to the middle of the outline, in the camera's frame.
    pub direction: [f64; 3],
    /// Unit vectors, in the camera's frame, along which the outline has its two ends each: nearly to the right
    /// and down in the image, at right angles to the line of sight.
    pub across: [[f64; 3]; 2],
    /// Distance of the nearest point along the direction, metres.
    pub nearest: f64,
    /// Which sides of the outline are those of the thing.
    pub completeness: Completeness,
}

impl ObjectSighting {
    /// The sighting of an observation; `None` when it is too near to have an outline.
    pub(crate) fn of(
        observation: &ObjectObservation,
        timestamp: f64,
        world_from_camera: &Pose,
    ) -> Option<Self> {
        let [toward, right, down] = line_of_sight(&observation.points)?;
        let (mut low, mut high, mut nearest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2], f64::INFINITY);
        for point in &observation.points {
            let point = point.map(f64::from);
            let depth = dot(point, toward);
            if depth <= 0.0 {
                return None;
            }
            nearest = nearest.min(depth);
            for (axis, side) in [right, down].into_iter().enumerate() {
                let slope = dot(point, side) / depth;
                (low[axis], high[axis]) = (low[axis].min(slope), high[axis].max(slope));
            }
        }
        let [u, v] = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
        Some(Self {
            timestamp,
            world_from_camera: *world_from_camera,
            direction: unit(along(along(toward, u, right), v, down))?,
            across: [right, down],
            nearest,
            completeness: observation.completeness,
        })
    }

    /// For each direction [`across`](Self::across), whether both ends of the outline are those of the thing.
    pub fn has_both_ends(&self) -> [bool; 2] {
        let [left, top, right, bottom] = self.completeness.sides().map(|side| side == SideView::Whole);
        [left && right, top && bottom]
    }

    /// Whether it says more of where the thing is: along more directions, or from nearer.
    pub(crate) fn says_more_than(&self, other: &Self) -> bool {
        let known = |sighting: &Self| sighting.has_both_ends().into_iter().filter(|known| *known).count();
        let (own, others) = (known(self), known(other));
        own > others || (own == others && self.nearest < other.nearest)
    }

    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        let vectors = self.across.iter().chain([&self.direction]);
        vectors.flatten().all(|c| c.abs() <= 1.01)
            && self.timestamp.is_finite()
            && (0.0..1e6).contains(&self.nearest)
    }
}

/// Unit vectors: to the middle of points, and at right angles to that, to the right and down in the image.
fn line_of_sight(points: &[Point]) -> Option<[Vector3; 3]> {
    let mut sum = [0.0; 3];
    for point in points {
        sum = [0, 1, 2].map(|axis| sum[axis] + f64::from(point[axis]));
    }
    let toward = unit(sum)?;
    let right = unit(cross([0.0, 1.0, 0.0], toward))?;
    Some([toward, right, cross(toward, right)])
}

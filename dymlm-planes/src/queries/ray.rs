use dymlm_core::PlaneId;
use dymlm_core::vector3::{along, bounds, crossing, dot, unit};

use crate::patches::VoxelBox;
use crate::plane_map::{MapPlane, PlaneMap};

/// Length of the parts into which a ray is divided, metres; for each part, the planes near it are tested.
const STEP: f64 = 1.0;

/// Where a ray meets a finite plane.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneHit {
    /// The plane.
    pub plane: PlaneId,
    /// Distance along the ray, metres.
    pub distance: f64,
    /// The point that is hit, metres.
    pub point: [f64; 3],
}

impl PlaneMap {
    /// The first confirmed plane that a ray meets within `max_range` metres, from either side. A plane is met
    /// only where it has inliers, to a voxel. A direction without length meets nothing, nor does a ray from an
    /// origin that is not finite, nor one with a range that is NaN (infinite for no limit). O(planes along
    /// the ray).
    pub fn cast_ray(&self, origin: [f64; 3], direction: [f64; 3], max_range: f64) -> Option<PlaneHit> {
        // The lesser of NaN and the map's end would be the map's end: no limit.
        if max_range.is_nan() {
            return None;
        }
        let direction = unit(direction)?;
        let voxel_size = self.config().voxel_size;
        let [enter, leave] = crossing(origin, direction, self.region()?)?;
        let max_range = max_range.min(leave);
        let mut from = (enter / STEP).floor() * STEP;
        // From so far away that a step is rounded off, nothing is met.
        while from <= max_range && from < from + STEP {
            let to = from + STEP;
            let part = bounds([from, to].map(|distance| along(origin, distance, direction)));
            let near = self.confirmed_near(VoxelBox::around(part, voxel_size).grown(1));
            // Among equally near hits the oldest plane wins.
            let hits = near.filter_map(|plane| hit(plane, origin, direction, max_range));
            let first = hits.min_by(|a, b| a.distance.total_cmp(&b.distance));
            // A hit beyond this part may lie behind a plane that is not near it yet.
            if let Some(first) = first.filter(|first| first.distance <= to) {
                return Some(first);
            }
            from = to;
        }
        None
    }

    /// The confirmed plane under a point: the first one that a ray against `up` meets within `max_distance`
    /// metres.
    pub fn plane_under(&self, point: [f64; 3], up: [f64; 3], max_distance: f64) -> Option<PlaneHit> {
        self.cast_ray(point, up.map(|x| -x), max_distance)
    }
}

fn hit(plane: &MapPlane, origin: [f64; 3], direction: [f64; 3], max_range: f64) -> Option<PlaneHit> {
    let slope = dot(plane.plane().normal(), direction);
    let distance = -plane.plane().signed_distance(origin) / slope;
    // For a ray along the plane the quotient is infinite or NaN.
    if !(0.0..=max_range).contains(&distance) {
        return None;
    }
    let point = std::array::from_fn(|axis| origin[axis] + distance * direction[axis]);
    plane.holds(point).then(|| PlaneHit { plane: plane.id(), distance, point })
}

use dymlm_core::PlaneId;
use dymlm_core::vector3::{dot, unit};

use crate::plane_map::{MapPlane, PlaneMap};

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
    /// The first confirmed plane that a ray meets within `max_range` metres, from either side; a plane counts
    /// where its inliers are, to a voxel. A direction without length meets nothing. O(planes).
    pub fn cast_ray(&self, origin: [f64; 3], direction: [f64; 3], max_range: f64) -> Option<PlaneHit> {
        let direction = unit(direction)?;
        let hits = self.iter().filter_map(|plane| hit(plane, origin, direction, max_range));
        hits.min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.plane.cmp(&b.plane)))
    }

    /// The confirmed plane under a point: the first one met going against `up` within `max_distance` metres.
    pub fn plane_under(&self, point: [f64; 3], up: [f64; 3], max_distance: f64) -> Option<PlaneHit> {
        self.cast_ray(point, up.map(|x| -x), max_distance)
    }
}

fn hit(plane: &MapPlane, origin: [f64; 3], direction: [f64; 3], max_range: f64) -> Option<PlaneHit> {
    let slope = dot(plane.plane().normal(), direction);
    let distance = -plane.plane().signed_distance(origin) / slope;
    // Along the plane the quotient is infinite or NaN.
    if !(0.0..=max_range).contains(&distance) {
        return None;
    }
    let point = std::array::from_fn(|axis| origin[axis] + distance * direction[axis]);
    plane.holds(point).then(|| PlaneHit { plane: plane.id(), distance, point })
}

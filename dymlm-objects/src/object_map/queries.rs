use dymlm_core::PlaneId;
use dymlm_core::vector3::{Vector3, difference, dot, unit};

use super::{MapObject, ObjectMap, ObjectState};
use crate::ShapeKind;

/// Where a ray meets an object.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct RayHit<'a> {
    /// The object.
    pub object: &'a MapObject,
    /// Distance from the ray's origin to the object's surface, metres; 0 when the origin is inside.
    pub distance: f64,
    /// The point of the surface, metres, world.
    pub point: [f64; 3],
}

/// Queries return confirmed objects. Each costs O(objects), except [`near`](ObjectMap::near).
impl ObjectMap {
    /// The objects of a label, the oldest first.
    pub fn with_label<'a>(&'a self, label: &'a str) -> impl Iterator<Item = &'a MapObject> {
        self.objects().filter(move |object| object.label() == label)
    }

    /// The objects whose box is within `reach` metres of a point, nearest first (the oldest among equals);
    /// none for a point that is not finite. O(objects near, or all objects when the reach is vast).
    pub fn near(&self, point: [f64; 3], reach: f64) -> Vec<&MapObject> {
        let mut found = Vec::new();
        if point.iter().all(|c| c.is_finite()) && reach >= 0.0 {
            self.index.within([-reach, reach].map(|side| point.map(|c| c + side)), &mut found);
        }
        let found = found
            .into_iter()
            .filter_map(|birth| self.born(birth))
            .filter(|object| object.state == ObjectState::Confirmed);
        let measured = found.map(|object| (distance_to_box(object, point), object));
        let mut near: Vec<_> = measured.filter(|(distance, _)| *distance <= reach).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().map(|(_, object)| object).collect()
    }

    /// The objects that a ray meets, nearest first (the oldest among equals); each object is a box or an
    /// ellipsoid according to its shape. Nothing is met from an origin that is not finite, or in a direction
    /// of zero length.
    pub fn along_ray(&self, origin: [f64; 3], direction: [f64; 3]) -> Vec<RayHit<'_>> {
        let direction = unit(direction).filter(|_| origin.iter().all(|c| c.is_finite()));
        let Some(direction) = direction else { return Vec::new() };
        let hit = |object| {
            let distance = distance_along(object, origin, direction)?;
            let point = [0, 1, 2].map(|k| origin[k] + distance * direction[k]);
            Some(RayHit { object, distance, point })
        };
        let mut hits: Vec<_> = self.objects().filter_map(hit).collect();
        hits.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        hits
    }

    /// The objects that stand on a plane of the plane map, the oldest first: the cup on the table.
    pub fn on_plane(&self, plane_id: PlaneId) -> impl Iterator<Item = &MapObject> {
        self.objects()
            .filter(move |object| object.support().is_some_and(|support| support.id == Some(plane_id)))
    }
}

fn distance_to_box(object: &MapObject, point: Vector3) -> f64 {
    let own = object.oriented_box();
    let local = own.world_from_box().inverse().transform_point(point);
    let half = own.lengths().map(|length| 0.5 * length);
    let outside: [f64; 3] = std::array::from_fn(|axis| (local[axis].abs() - half[axis]).max(0.0));
    dot(outside, outside).sqrt()
}

fn distance_along(object: &MapObject, origin: Vector3, direction: Vector3) -> Option<f64> {
    let own = object.oriented_box();
    let object_from_world = own.world_from_box().inverse();
    let start = object_from_world.transform_point(origin);
    let along = object_from_world.rotate(direction);
    let half = own.lengths().map(|length| 0.5 * length);
    match object.shape {
        ShapeKind::Cuboid => distance_to_slabs(start, along, half),
        ShapeKind::Ellipsoid => distance_to_ellipsoid(start, along, half),
    }
}

fn distance_to_slabs(start: Vector3, along: Vector3, half: Vector3) -> Option<f64> {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        if along[axis] == 0.0 {
            if start[axis].abs() > half[axis] {
                return None;
            }
            continue;
        }
        let [a, b] = [-half[axis], half[axis]].map(|side| (side - start[axis]) / along[axis]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter <= leave && enter.is_finite()).then_some(enter)
}

fn distance_to_ellipsoid(start: Vector3, along: Vector3, half: Vector3) -> Option<f64> {
    if !half.iter().all(|&h| h > 0.0) {
        return distance_to_slabs(start, along, half);
    }
    let scaled = |v: Vector3| [0, 1, 2].map(|axis| v[axis] / half[axis]);
    let (start, along) = (scaled(start), scaled(along));
    let (a, b, c) = (dot(along, along), dot(start, along), dot(start, start) - 1.0);
    if c <= 0.0 {
        return Some(0.0);
    }
    // Solved relative to the ray's point closest to the centre, where no digits cancel.
    let closest = difference(start, along.map(|x| x * b / a));
    let remainder = 1.0 - dot(closest, closest);
    let distance = (-b - (a * remainder).max(0.0).sqrt()) / a;
    (remainder >= 0.0 && distance >= 0.0 && distance.is_finite()).then_some(distance)
}

use dymlm_core::vector3::Vector3;

use crate::{MapObject, ObjectObservation};

/// Most points of an observation that are compared.
const MAX_POINTS: usize = 128;

/// Share of an observation's points that an object also has, 0..=1: of the caller's map points when both have
/// some, otherwise of the surface points that lie in occupied cells of the object's cloud. `places` are the
/// observation's points in the world. `None` when there is nothing to compare.
pub(super) fn shared_share(
    observation: &ObjectObservation,
    places: &[Vector3],
    object: &MapObject,
) -> Option<f64> {
    object.sighted_points.shared_share(&observation.sighted_points).or_else(|| {
        let shared = places.iter().filter(|&&place| object.cloud.holds(place)).count();
        (!places.is_empty()).then(|| shared as f64 / places.len() as f64)
    })
}

/// At most [`MAX_POINTS`] of an observation's points, in the world.
pub(crate) fn sample_places(
    observation: &ObjectObservation,
    world_from_camera: &dymlm_core::Pose,
    places: &mut Vec<Vector3>,
) {
    let step = observation.points.len().div_ceil(MAX_POINTS).max(1);
    let chosen = observation.points.iter().step_by(step);
    places.clear();
    places.extend(chosen.map(|point| world_from_camera.transform_point(point.map(f64::from))));
}

use dymlm_core::SensorModel;
use dymlm_core::vector3::dot;

use super::detected_plane::DetectedPlane;
use crate::linear_algebra::{foot_on, quadratic_form};

/// Cosine of the largest angle between planes that count as parallel: 10 degrees.
const COS_PARALLEL: f64 = 0.985;
/// A surface that joins two parallel planes ends at them. The least-squares plane through readings of one on one
/// side and of the other on the other side goes beyond: it deviates 3/2 times as far from its middle, or more
/// where the parts are unequal. Half way between the two it is decided.
const OVERSHOOT: f64 = 1.25;

/// The step between two parallel planes of the frame, metres, if `plane` goes through it and is no surface of its
/// own: a slanted plane at the rim of a flat thing on a wall, whose step the noise hides.
///
/// O(planes squared).
pub(super) fn through_step(
    plane: &DetectedPlane,
    planes: &[DetectedPlane],
    sensor: &SensorModel,
) -> Option<f64> {
    let others = || planes.iter().filter(|other| other.label != plane.label);
    let widest = 2.0 * sensor.tolerance(plane.centroid[2] as f32, 0.0);
    others().find_map(|front| {
        let behind = -front.plane.signed_distance(plane.centroid);
        let normal = front.plane.normal();
        let is_slanted = dot(normal, plane.plane.normal()) < COS_PARALLEL;
        let deviation =
            (is_slanted && behind > 0.0 && behind < widest).then(|| deviation_along(plane, normal))?;
        others().find_map(|back| {
            let step = -front.plane.signed_distance(foot_on(&back.plane, plane.centroid));
            let nearer = behind.min(step - behind);
            let is_between = nearer > 0.0 && step < widest && deviation < step;
            let is_through = is_between
                && dot(normal, back.plane.normal()) > COS_PARALLEL
                && deviation > OVERSHOOT * evenly_spread(nearer);
            is_through.then_some(step)
        })
    })
}

/// Standard deviation along a direction, metres, of a plane's own points, without the noise across it.
fn deviation_along(plane: &DetectedPlane, direction: [f64; 3]) -> f64 {
    let noise = plane.mse * dot(direction, plane.plane.normal()).powi(2);
    (quadratic_form(&plane.moments.covariance(), direction) - noise).max(0.0).sqrt()
}

/// Standard deviation of points that are spread evenly up to a distance on both sides of their middle.
fn evenly_spread(distance: f64) -> f64 {
    distance / 3.0_f64.sqrt()
}

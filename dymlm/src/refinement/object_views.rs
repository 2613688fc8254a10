use std::collections::BTreeMap;

use dymlm_core::vector3::{Vector3, along, dot, norm};
use dymlm_core::{ObjectId, SensorModel};
use dymlm_objects::{MapObject, ObjectMap, ObjectSighting, ShapeKind};
use dymlm_refine::LandmarkView;

use super::RefineConfig;
use super::pose_problem::KeyFramePose;

/// Error of the middle of the outline of a side, as a share of the object's extent across the line of sight:
/// one deviation. At true poses it is 0.066, of 1,600 outlines in five simulated sequences: things are neither
/// boxes nor ellipsoids, and detectors cut off their ends. Sides beside each other err somewhat alike, so that
/// they count less than that: with 0.08, one of six drifts in a room of 80 frames ends 7 % farther off than
/// without objects, with 0.12 none ends more than 4 % farther off.
const OUTLINE_ERROR: f64 = 0.12;
/// Cosine between the normal of the plane on which an object stands and a direction across the line of sight
/// from which on the outline ends at that plane: 60 degrees.
const UPRIGHT: f64 = 0.5;

/// Where the key frames have seen the centres of the objects. Outlines of one side err alike, so that all
/// sightings of a side together say as much of the centre as one: each has the variance of an outline's error
/// as many times as there are.
pub(super) fn views_by_object(
    objects: &ObjectMap,
    key_frames: &[KeyFramePose],
    sensor: &SensorModel,
    config: &RefineConfig,
) -> BTreeMap<ObjectId, Vec<LandmarkView>> {
    let of = |object: &MapObject| {
        let of_side = |side: &[ObjectSighting]| -> Vec<LandmarkView> {
            let mapped =
                side.iter().filter_map(|sighting| Some((key_frame_of(sighting, key_frames)?, sighting)));
            let mapped: Vec<(usize, &ObjectSighting)> = mapped.collect();
            let outline_error = OUTLINE_ERROR * (mapped.len() as f64).sqrt();
            let view = |(pose, sighting)| center_view(pose, object, sighting, sensor, config, outline_error);
            mapped.into_iter().filter_map(view).collect()
        };
        (object.id(), object.sightings_by_side().flat_map(of_side).collect())
    };
    objects.objects().map(of).collect()
}

/// The index of the key frame of a sighting; `None` when it is no longer mapped at that pose.
fn key_frame_of(sighting: &ObjectSighting, key_frames: &[KeyFramePose]) -> Option<usize> {
    let first = key_frames.partition_point(|key_frame| key_frame.time < sighting.timestamp);
    let at_that_time = key_frames[first..].iter().take_while(|own| own.time <= sighting.timestamp);
    let place =
        at_that_time.into_iter().position(|own| own.world_from_camera == sighting.world_from_camera)?;
    Some(first + place)
}

/// Where a sighting has the object's centre: behind the middle of its outline, by half the depth that its
/// box has there.
///
/// Only across the line of sight does the outline say where that is, and only where both its ends are the
/// thing's. How deep the thing is behind its front, and where it ends at the plane on which it stands, is
/// biased by some centimetres, and for all things alike, so that no number of views averages it out: by such
/// depths a corridor would be longer on the way back. Along these directions the deviation is the distance;
/// `None` when this is so of all.
fn center_view(
    pose: usize,
    object: &MapObject,
    sighting: &ObjectSighting,
    sensor: &SensorModel,
    config: &RefineConfig,
    outline_error: f64,
) -> Option<LandmarkView> {
    let in_world = |direction: Vector3| sighting.world_from_camera.rotate(direction);
    let distance = sighting.nearest + half_extent(object, in_world(sighting.direction));
    let noise = config.common_noise * f64::from(sensor.sigma(sighting.nearest as f32));
    let up = object.support().map(|support| support.plane.normal());
    let is_known = [0, 1].map(|axis| {
        let is_upright = |up: Vector3| dot(up, in_world(sighting.across[axis])).abs() > UPRIGHT;
        sighting.has_both_ends()[axis] && !up.is_some_and(is_upright)
    });
    if distance <= 0.0 || is_known == [false; 2] {
        return None;
    }
    let across = [0, 1].map(|axis| {
        let direction = sighting.across[axis];
        let error = outline_error * 2.0 * half_extent(object, in_world(direction));
        (direction, if is_known[axis] { norm([noise, error, 0.0]) } else { distance })
    });
    let axes = [across[0], across[1], (sighting.direction, distance)];
    let entry = |row: usize, column: usize| {
        axes.iter().map(|(axis, deviation)| deviation * deviation * axis[row] * axis[column]).sum()
    };
    Some(LandmarkView {
        pose,
        place: along([0.0; 3], distance, sighting.direction),
        covariance: [0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column))),
    })
}

/// From an object's centre to its end in a direction, a unit vector of the world.
fn half_extent(object: &MapObject, direction: Vector3) -> f64 {
    let oriented_box = object.oriented_box();
    let local = oriented_box.world_from_box().inverse().rotate(direction);
    let lengths = oriented_box.lengths();
    let parts = [0, 1, 2].map(|axis| 0.5 * lengths[axis] * local[axis].abs());
    match object.shape().kind() {
        ShapeKind::Ellipsoid => norm(parts),
        ShapeKind::Cuboid => parts.iter().sum(),
    }
}

use std::collections::BTreeMap;

use dymlm_core::vector3::{Vector3, along, difference, dot, norm, unit};
use dymlm_core::{ObjectId, SensorModel};
use dymlm_objects::{MapObject, ObjectMap, ObjectSighting, ShapeKind, SideView};
use dymlm_refine::LandmarkView;

use super::RefineConfig;
use super::pose_problem::KeyFramePose;

/// Error of the middle of an outline, as a share of the object's extent across the line of sight: one
/// deviation. At true poses it is 0.066 across and 0.083 upwards, of 1,600 outlines in five simulated
/// sequences. Things are neither boxes nor ellipsoids, and detectors cut off their ends.
const OUTLINE_ERROR: f64 = 0.08;
/// The same where something hides an end: the middle may be anywhere in the object.
const CUT_OUTLINE_ERROR: f64 = 0.5;
/// Error of the centre along the line of sight, as a share of half the depth that the object has there. Of
/// that depth one frame sees only the front; the rest is known by the object's box, which is as good as the
/// object's other views. At true poses it is 0.31.
const DEPTH_ERROR: f64 = 0.5;
/// Cosine of the angle at the object from which on views show other sides: 15 degrees, as for the objects.
const SIDE_COSINE: f64 = 0.966;
/// After this time, seconds, an object counts anew though its side is the same: less drift than the error of
/// an outline is not noticed.
const SIDE_TIME: f64 = 3.0;

/// Where the key frames have seen the centres of the objects. Outlines of one side err alike, so each side
/// counts once, by the view that says most.
pub(super) fn views_by_object(
    objects: &ObjectMap,
    key_frames: &[KeyFramePose],
    sensor: &SensorModel,
    config: &RefineConfig,
) -> BTreeMap<ObjectId, Vec<LandmarkView>> {
    let of = |object: &MapObject| {
        let mut sides: Vec<Side> = Vec::new();
        for sighting in object.sightings() {
            let Some(pose) = key_frame_of(sighting, key_frames) else { continue };
            let Some(view) = center_view(pose, object, sighting, sensor, config) else { continue };
            match sides.last_mut().filter(|side| side.shows(object, sighting)) {
                Some(side) => side.consider(view),
                None => sides.push(Side { begin: *sighting, best: view }),
            }
        }
        (object.id(), sides.into_iter().map(|side| side.best).collect())
    };
    objects.objects().map(of).collect()
}

/// Consecutive sightings of one side of an object.
struct Side {
    begin: ObjectSighting,
    best: LandmarkView,
}

impl Side {
    fn shows(&self, object: &MapObject, sighting: &ObjectSighting) -> bool {
        let center = object.oriented_box().center();
        let from = |sighting: &ObjectSighting| {
            unit(difference(sighting.world_from_camera.translation(), center))
        };
        let turn = from(&self.begin).zip(from(sighting)).map(|(a, b)| dot(a, b));
        sighting.timestamp - self.begin.timestamp < SIDE_TIME
            && turn.is_some_and(|cosine| cosine >= SIDE_COSINE)
    }

    fn consider(&mut self, view: LandmarkView) {
        if total_variance(&view) < total_variance(&self.best) {
            self.best = view;
        }
    }
}

fn total_variance(view: &LandmarkView) -> f64 {
    (0..3).map(|k| view.covariance[k][k]).sum()
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
/// box has there. The covariance is that of the outline across the line of sight, and along it grows with
/// the depth that is not seen.
fn center_view(
    pose: usize,
    object: &MapObject,
    sighting: &ObjectSighting,
    sensor: &SensorModel,
    config: &RefineConfig,
) -> Option<LandmarkView> {
    let half = |direction: Vector3| half_extent(object, sighting.world_from_camera.rotate(direction));
    let noise = config.common_noise * f64::from(sensor.sigma(sighting.nearest as f32));
    let [left, top, right, bottom] = sighting.completeness.sides().map(|side| side == SideView::Whole);
    let is_whole = [left && right, top && bottom];
    let across = [0, 1].map(|axis| {
        let share = if is_whole[axis] { OUTLINE_ERROR } else { CUT_OUTLINE_ERROR };
        let direction = sighting.across[axis];
        (direction, norm([noise, 2.0 * share * half(direction), 0.0]))
    });
    let depth = half(sighting.direction);
    let toward = (sighting.direction, norm([noise, DEPTH_ERROR * depth, 0.0]));
    let axes = [across[0], across[1], toward];
    let entry = |row: usize, column: usize| {
        axes.iter().map(|(axis, deviation)| deviation * deviation * axis[row] * axis[column]).sum()
    };
    let place = along([0.0; 3], sighting.nearest + depth, sighting.direction);
    let covariance = [0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column)));
    (depth > 0.0).then_some(LandmarkView { pose, place, covariance })
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

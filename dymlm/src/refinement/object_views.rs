use std::collections::BTreeMap;

use dymlm_core::vector3::{Vector3, along, difference, dot, norm, unit};
use dymlm_core::{ObjectId, SensorModel};
use dymlm_objects::{MapObject, ObjectMap, ObjectSighting, ShapeKind, SideView};
use dymlm_refine::LandmarkView;

use super::RefineConfig;
use super::pose_problem::KeyFramePose;

/// Error of the middle of an outline, as a share of the object's extent across the line of sight: one
/// deviation. At true poses it is 0.066, of 1,600 outlines in five simulated sequences: things are neither
/// boxes nor ellipsoids, and detectors cut off their ends.
const OUTLINE_ERROR: f64 = 0.08;
/// Cosine between the normal of the plane on which an object stands and a direction across the line of sight
/// from which on the outline ends at that plane: 60 degrees.
const UPRIGHT: f64 = 0.5;
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
        (object.id(), sides.into_iter().map(|side| side.best.view).collect())
    };
    objects.objects().map(of).collect()
}

/// Consecutive sightings of one side of an object.
struct Side {
    begin: ObjectSighting,
    best: CenterView,
}

/// A view of an object's centre.
struct CenterView {
    view: LandmarkView,
    /// Sum of the inverse variances along its axes.
    certainty: f64,
}

impl Side {
    fn shows(&self, object: &MapObject, sighting: &ObjectSighting) -> bool {
        let center = object.oriented_box().center();
        let from =
            |sighting: &ObjectSighting| unit(difference(sighting.world_from_camera.translation(), center));
        let turn = from(&self.begin).zip(from(sighting)).map(|(a, b)| dot(a, b));
        sighting.timestamp - self.begin.timestamp < SIDE_TIME
            && turn.is_some_and(|cosine| cosine >= SIDE_COSINE)
    }

    fn consider(&mut self, view: CenterView) {
        if view.certainty > self.best.certainty {
            self.best = view;
        }
    }
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
/// depths a corridor would be longer on the way back. Along these directions the deviation is the distance.
fn center_view(
    pose: usize,
    object: &MapObject,
    sighting: &ObjectSighting,
    sensor: &SensorModel,
    config: &RefineConfig,
) -> Option<CenterView> {
    let in_world = |direction: Vector3| sighting.world_from_camera.rotate(direction);
    let distance = sighting.nearest + half_extent(object, in_world(sighting.direction));
    let noise = config.common_noise * f64::from(sensor.sigma(sighting.nearest as f32));
    let up = object.support().map(|support| support.plane.normal());
    let [left, top, right, bottom] = sighting.completeness.sides().map(|side| side == SideView::Whole);
    let has_both_ends = [left && right, top && bottom];
    let across = [0, 1].map(|axis| {
        let direction = in_world(sighting.across[axis]);
        let is_upright = up.is_some_and(|up| dot(up, direction).abs() > UPRIGHT);
        let error = OUTLINE_ERROR * 2.0 * half_extent(object, direction);
        let is_known = has_both_ends[axis] && !is_upright;
        (sighting.across[axis], if is_known { norm([noise, error, 0.0]) } else { distance })
    });
    let axes = [across[0], across[1], (sighting.direction, distance)];
    let entry = |row: usize, column: usize| {
        axes.iter().map(|(axis, deviation)| deviation * deviation * axis[row] * axis[column]).sum()
    };
    let covariance = [0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column)));
    let place = along([0.0; 3], distance, sighting.direction);
    let certainty = axes.iter().map(|(_, deviation)| 1.0 / (deviation * deviation)).sum();
    (distance > 0.0).then_some(CenterView { view: LandmarkView { pose, place, covariance }, certainty })
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

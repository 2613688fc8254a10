use std::sync::LazyLock;

use dymlm::tracking::{
    ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig, ObjectUpdate, RestReport,
};
use dymlm::{Detections, MapBuilder};
use dymlm_core::{
    ColorImage, DepthImage, Frame, FrameId, ObjectId, PinholeCamera, Pose, SplitMix64, decode_part,
    encode_part,
};

use crate::choices::Choices;
use crate::walk::{MAP, MAPPED, WALK};

/// A tracker of a thing and its first update. The maps use only the bounds from it, so one tracker serves for
/// all objects: those of the walk are too few pixels wide to be followed.
static FOLLOWED: LazyLock<(ObjectTracker, ObjectUpdate)> = LazyLock::new(|| {
    let [width, height] = [160, 120];
    let camera = PinholeCamera::new(width, height, 130.0, 130.0, 79.5, 59.5).unwrap();
    let depth = DepthImage::new(width, height, vec![1.0; width * height]).unwrap();
    let mut random = SplitMix64::new(1);
    let texture = (0..width * height).map(|_| [random.below(256) as u8; 3]).collect();
    let frame = Frame::new(0.0, camera, depth, ColorImage::new(width, height, texture).ok()).unwrap();
    let model = ObjectModel::cuboid([0.4, 0.4, 0.1]).unwrap();
    let stands = Pose::new([0.0, 0.0, 1.05], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let (camera, config) = (Pose::identity(), ObjectTrackerConfig::default());
    let mut tracker =
        ObjectTracker::new(&frame, &camera, model, None, &stands, MAP.config().sensor, &config).unwrap();
    let update = tracker.track(&frame, &[], &camera).unwrap();
    (tracker, update)
});

/// Objects of a map are carried and put down anywhere, while frames are inserted and poses are corrected.
pub fn carried_object(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let mut builder = MapBuilder::resume(MAP.clone()).unwrap();
    let mut next = MAPPED;
    for _ in 0..8 {
        if choices.is_over() {
            break;
        }
        let before = builder.map().clone();
        let refused = match choices.below(10) {
            0..=4 => follow(&mut builder, &mut choices),
            5 | 6 => {
                let Some(seen) = WALK.get(next) else { continue };
                next += 1;
                let found =
                    if choices.is_true() { Detections::Found(&seen.detections) } else { Detections::NotRun };
                builder.insert(&seen.frame, found, &seen.world_from_camera).is_err()
            }
            7 => {
                let poses: Vec<(FrameId, Pose)> =
                    builder.trajectory().map(|(id, _, pose)| (id, pose)).collect();
                let shift = choices.pose();
                let corrected: Vec<_> = poses
                    .into_iter()
                    .filter(|_| choices.is_true())
                    .map(|(id, pose)| (id, shift * pose))
                    .collect();
                builder.correct_poses(&corrected).is_err()
            }
            8 => builder.remove(FrameId::new(choices.below(16).into())).is_err(),
            _ => builder.transform(&choices.pose()).is_err(),
        };
        assert!(
            !refused || builder.map().counts() == before.counts(),
            "what was refused has changed the maps"
        );
    }
    builder.settle();
}

/// Tells the maps that an object was found anywhere; returns whether they refuse it.
fn follow(builder: &mut MapBuilder, choices: &mut Choices<'_>) -> bool {
    let (tracker, update) = &*FOLLOWED;
    let mut update = update.clone();
    let objects = builder.map().objects().objects().chain(builder.map().objects().candidates());
    let objects: Vec<_> =
        objects.map(|object| (object.id(), object.oriented_box().world_from_box())).collect();
    let Some(&(object, stands)) = objects.get(choices.number_below(objects.len())) else { return false };
    let states = [ObjectState::AtRest, ObjectState::Tracking, ObjectState::Occluded, ObjectState::Lost];
    update.state = states[usize::from(choices.below(4))];
    update.world_from_object = choices.pose() * stands;
    update.came_to_rest = choices.is_true().then(|| {
        let moved_from = if choices.byte() < 240 { stands } else { choices.pose() };
        let since = choices.number();
        // The value is decoded, since its type has no constructor.
        let rest = encode_part(&(update.world_from_object, moved_from, since)).unwrap();
        decode_part::<RestReport>(0, &rest).unwrap()
    });
    let object = if choices.byte() < 250 { object } else { ObjectId::new(choices.byte().into()) };
    builder.follow_object(object, tracker, &update).is_err()
}

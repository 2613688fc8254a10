use dymlm::core::ObjectId;
use dymlm::{MapBuilder, MapConfig};
use dymlm_examples::{AnyError, progress_bar};
use dymlm_sim::{
    CameraPath, CarriedKind, CarriedMotion, CarriedObject, Sequence, SequenceConfig, SimulatedFrame,
};

use crate::errors::{Errors, thing_pose};
use crate::follow::{Followed, Follower};

/// Frames a second; the thing stands for a second, is carried for six, then stands again.
const RATE: f64 = 30.0;
const FRAMES: usize = 250;
/// Number of frames that are mapped before the thing is chosen.
const MAPPED: usize = 28;
/// Indices of the frames that are drawn: in the hand, and at the end.
const IN_HAND: usize = 130;

/// Follows a thing that a hand carries in the rendered office.
pub(crate) fn follow(kind: CarriedKind, has_depth: bool) -> Result<Followed, AnyError> {
    let motion = match kind {
        CarriedKind::Bottle => CarriedMotion::RotationY,
        _ => CarriedMotion::RotationX,
    };
    let sequence = Sequence::new(&config(kind, motion))?;
    let bar = progress_bar(sequence.len(), "following");
    let mut builder = MapBuilder::new(MapConfig::default())?;
    let mut frames = sequence.frames();
    let mut last = None;
    for frame in frames.by_ref().take(MAPPED) {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera)?;
        bar.inc(1);
        last = Some(frame);
    }
    let first = last.ok_or("no frames")?;
    let thing = first.carried.ok_or("nothing is carried")?;
    let object = object_at(&builder, &first).ok_or("the thing is not in the object map")?;
    let mapped = builder.map().objects().object(object).ok_or("no such object")?;
    let start = mapped.oriented_box().world_from_box();

    let mut follower = Follower::new(builder, object, &first.frame, &first.world_from_camera, has_depth)?;
    follower.picture("object map", &first.frame, &first.world_from_camera);
    let mut errors = Errors::default();
    for (index, frame) in (MAPPED..).zip(frames) {
        let found = follower.step(&frame.frame, Some(&frame.detections), &frame.world_from_camera)?;
        if let (Some(pose), Some(truth)) = (found, frame.carried) {
            errors.add(kind, &thing_pose(&pose, &start, &thing), &truth.world_from_object);
        }
        if index == IN_HAND {
            follower.picture("in the hand", &frame.frame, &frame.world_from_camera);
        }
        if index + 1 == FRAMES {
            follower.picture("put down", &frame.frame, &frame.world_from_camera);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(follower.finish(Some(errors)))
}

fn config(kind: CarriedKind, motion: CarriedMotion) -> SequenceConfig {
    let mut config = SequenceConfig::default();
    config.people = 0;
    config.frame_rate = RATE;
    config.frames = FRAMES;
    config.path = CameraPath::Xyz;
    config.carried = Some(CarriedObject::new(kind, motion));
    config
}

/// The object of the map at the thing's place.
fn object_at(builder: &MapBuilder, frame: &SimulatedFrame) -> Option<ObjectId> {
    let thing = frame.carried?;
    let place = thing.world_from_object.translation();
    let distance = |center: [f64; 3]| (0..3).map(|i| (center[i] - place[i]).powi(2)).sum::<f64>().sqrt();
    // Candidates count too: within a second, the thing may not have been detected often enough to be
    // confirmed.
    let map = builder.map().objects();
    let objects = map.objects().chain(map.candidates());
    objects
        .filter(|object| object.label() == thing.label)
        .map(|object| (distance(object.oriented_box().center()), object.id()))
        .filter(|(distance, _)| *distance < 0.15)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, id)| id)
}

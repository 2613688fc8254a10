//! A hand carries things through the rendered office; the tracker must know where they are.

use dymlm_core::{DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_sim::{
    CameraPath, CarriedKind, CarriedMotion, CarriedObject, CarriedThing, Sequence, SequenceConfig,
    SimulatedFrame,
};
use dymlm_tracking::{
    CornerDetector, Error, KcfTracker, ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig,
    ObjectUpdate, OpticalFlow, PoseRansac, PoseRefiner, RestReport,
};

fn sequence(kind: CarriedKind, motion: CarriedMotion, frames: usize) -> Sequence {
    seen_by(None, kind, motion, frames)
}

fn seen_by(
    camera: Option<PinholeCamera>,
    kind: CarriedKind,
    motion: CarriedMotion,
    frames: usize,
) -> Sequence {
    let mut config = SequenceConfig::default();
    config.people = 0;
    // The frame rate of a busy robot: a hand moves by some centimetres between two frames.
    config.frame_rate = 10.0;
    config.frames = frames;
    config.path = CameraPath::Static;
    config.camera = camera;
    config.carried = Some(CarriedObject::new(kind, motion));
    Sequence::new(&config).unwrap()
}

fn model(thing: &CarriedThing) -> ObjectModel {
    ObjectModel::cuboid(thing.lengths).unwrap()
}

fn start(frame: &SimulatedFrame) -> ObjectTracker {
    let thing = frame.carried.unwrap();
    let config = ObjectTrackerConfig::default();
    let pose = &thing.world_from_object;
    ObjectTracker::new(
        &frame.frame,
        &frame.world_from_camera,
        model(&thing),
        Some(thing.label),
        pose,
        SensorModel::kinect(),
        &config,
    )
    .unwrap()
}

fn without_depth(frame: &Frame) -> Frame {
    let camera = frame.camera();
    let depth = DepthImage::new(camera.width(), camera.height(), vec![0.0; camera.width() * camera.height()])
        .unwrap();
    Frame::new(frame.timestamp(), *camera, depth, frame.color().cloned()).unwrap()
}

/// The results of a whole sequence.
struct Outcome {
    /// Errors in metres and radians of the frames with a pose, sorted.
    distances: Vec<f64>,
    angles: Vec<f64>,
    misses: usize,
    losses: usize,
    rests: Vec<RestReport>,
    last: ObjectUpdate,
}

fn follow(sequence: &Sequence, has_depth: bool) -> Outcome {
    let mut frames = sequence.frames();
    let seen =
        |frame: &SimulatedFrame| if has_depth { frame.frame.clone() } else { without_depth(&frame.frame) };
    let first = frames.next().unwrap();
    let thing = first.carried.unwrap();
    let config = ObjectTrackerConfig::default();
    let mut tracker = ObjectTracker::new(
        &seen(&first),
        &first.world_from_camera,
        model(&thing),
        Some(thing.label),
        &thing.world_from_object,
        SensorModel::kinect(),
        &config,
    )
    .unwrap();
    let (mut distances, mut angles, mut rests) = (Vec::new(), Vec::new(), Vec::new());
    let (mut misses, mut losses, mut was_lost, mut last) = (0, 0, false, None);
    for frame in frames {
        let truth = frame.carried.unwrap().world_from_object;
        let update = tracker.track(&seen(&frame), &frame.detections, &frame.world_from_camera).unwrap();
        if update.inliers > 0 {
            distances.push(update.world_from_object.distance(&truth));
            angles.push(update.world_from_object.angle(&truth));
        } else {
            misses += 1;
        }
        let is_lost = update.state == ObjectState::Lost;
        losses += usize::from(is_lost && !was_lost);
        was_lost = is_lost;
        rests.extend(update.came_to_rest);
        last = Some(update);
    }
    distances.sort_by(f64::total_cmp);
    angles.sort_by(f64::total_cmp);
    Outcome { distances, angles, misses, losses, rests, last: last.unwrap() }
}

/// A loop closure moves the world by 30 cm and turns it; once while the box stands, once while it is carried.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_moved_world_moves_no_object() {
    let sequence = sequence(CarriedKind::Box, CarriedMotion::RotationZ, 86);
    let new_from_old = Pose::new([0.3, -0.2, 0.1], [0.1, 0.2, 0.3, 0.927_361_849]).unwrap();
    let mut frames = sequence.frames();
    let mut tracker = start(&frames.next().unwrap());
    // Each with the frame before which its world moves.
    let mut moved_trackers = [8, 40].map(|closure| (closure, tracker.clone(), Pose::identity()));
    for (index, frame) in frames.enumerate() {
        let stays = tracker.track(&frame.frame, &[], &frame.world_from_camera).unwrap();
        for (closure, moved_tracker, world) in &mut moved_trackers {
            if index == *closure {
                *world = new_from_old;
                moved_tracker.move_world(world);
            }
            let world = *world;
            let moved = moved_tracker.track(&frame.frame, &[], &(world * frame.world_from_camera)).unwrap();
            assert_eq!(moved.state, stays.state, "frame {index}");
            let expected = world * stays.world_from_object;
            assert!(moved.world_from_object.distance(&expected) < 1e-3, "frame {index}");
            assert!(moved.world_from_object.angle(&expected) < 5e-3, "frame {index}");
            assert_eq!(moved.came_to_rest.is_some(), stays.came_to_rest.is_some(), "frame {index}");
            for (moved, stays) in moved.came_to_rest.iter().zip(&stays.came_to_rest) {
                assert!(moved.moved_from.distance(&(world * stays.moved_from)) < 1e-3);
            }
        }
    }
}

fn median(values: &[f64]) -> f64 {
    values[values.len() / 2]
}

#[test]
fn follows_a_box_through_turns_and_tells_where_it_was_put() {
    let sequence = sequence(CarriedKind::Box, CarriedMotion::RotationZ, 86);
    let outcome = follow(&sequence, true);
    assert!(median(&outcome.distances) < 0.01, "{} m", median(&outcome.distances));
    assert!(median(&outcome.angles) < 3_f64.to_radians(), "{} rad", median(&outcome.angles));
    assert_eq!((outcome.misses, outcome.losses), (0, 0));
    assert_eq!(outcome.last.state, ObjectState::AtRest);
    let [rest] = outcome.rests[..] else { panic_with(outcome.rests.len()) };
    let first = sequence.carried_thing(0).unwrap().world_from_object;
    let last = sequence.carried_thing(85).unwrap().world_from_object;
    assert!(rest.world_from_object.distance(&last) < 0.01 && rest.world_from_object.angle(&last) < 0.05);
    assert!(rest.moved_from.distance(&first) < 0.01);
    assert!((6.0..7.3).contains(&rest.since), "{}", rest.since);
}

#[allow(clippy::panic, reason = "tests")]
fn panic_with(rests: usize) -> ! {
    panic!("{rests} places of rest instead of one")
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn cameras_of_half_and_twice_the_focal_length_follow_as_well() {
    let small = PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap();
    let large = PinholeCamera::new(1280, 720, 1050.0, 1050.0, 639.5, 359.5).unwrap();
    for camera in [small, large] {
        let sequence = seen_by(Some(camera), CarriedKind::Box, CarriedMotion::RotationZ, 36);
        let outcome = follow(&sequence, true);
        let [distance, angle] = [&outcome.distances, &outcome.angles].map(|values| median(values));
        println!("f = {} px: {:.2} cm, {:.2} deg", camera.fx(), 100.0 * distance, angle.to_degrees());
        assert!(distance < 0.01 && angle < 3_f64.to_radians(), "{distance} m, {angle} rad");
        assert_eq!((outcome.misses, outcome.losses), (0, 0));
    }
}

#[test]
fn follows_without_depth() {
    let outcome = follow(&sequence(CarriedKind::Box, CarriedMotion::Translation, 36), false);
    assert!(median(&outcome.distances) < 0.025, "{} m", median(&outcome.distances));
    assert!(median(&outcome.angles) < 5_f64.to_radians(), "{} rad", median(&outcome.angles));
    assert!(outcome.losses <= 1);
}

#[test]
fn an_occluded_thing_is_found_again() {
    let sequence = sequence(CarriedKind::Cup, CarriedMotion::Occlusion, 75);
    let mut frames = sequence.frames();
    let mut tracker = start(&frames.next().unwrap());
    let (mut states, mut misses, mut longest) = (Vec::new(), 0, 0);
    let mut last = f64::INFINITY;
    for frame in frames {
        let update = tracker.track(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        if states.last() != Some(&update.state) {
            states.push(update.state);
        }
        let truth = frame.carried.unwrap().world_from_object;
        let is_miss = update.inliers == 0;
        misses = if is_miss { misses + 1 } else { 0 };
        longest = longest.max(misses);
        last = update.world_from_object.distance(&truth);
    }
    assert!(
        states.contains(&ObjectState::Occluded) && states.contains(&ObjectState::Recovered),
        "{states:?}"
    );
    // The hand occludes it for a little more than two seconds at 10 Hz.
    assert!(longest <= 33, "{longest} frames without a pose");
    assert!(last < 0.01, "{last} m off at the end");
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let sequence = sequence(CarriedKind::Book, CarriedMotion::RotationX, 70);
    let frames: Vec<SimulatedFrame> = sequence.frames().skip(8).take(16).collect();
    let run = || {
        let mut tracker = start(&frames[0]);
        frames[1..]
            .iter()
            .map(|frame| tracker.track(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap())
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn refused_frames_change_nothing() {
    let sequence = sequence(CarriedKind::Box, CarriedMotion::Translation, 40);
    let frames: Vec<SimulatedFrame> = sequence.frames().take(4).collect();
    let track = |tracker: &mut ObjectTracker, frame: &SimulatedFrame| {
        tracker.track(&frame.frame, &[], &frame.world_from_camera)
    };
    let mut tracker = start(&frames[0]);
    let mut other = tracker.clone();
    track(&mut tracker, &frames[2]).unwrap();
    track(&mut other, &frames[2]).unwrap();
    assert!(matches!(track(&mut tracker, &frames[1]), Err(Error::TimeReversed { .. })));
    let gray = Frame::new(9.0, *frames[3].frame.camera(), frames[3].frame.depth().clone(), None).unwrap();
    assert_eq!(tracker.track(&gray, &[], &Pose::identity()), Err(Error::NoColor));
    assert_eq!(track(&mut tracker, &frames[3]), track(&mut other, &frames[3]));
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let sequence = sequence(CarriedKind::Box, CarriedMotion::Translation, 40);
    let frame = sequence.frame(0).unwrap();
    let thing = frame.carried.unwrap();
    let config = ObjectTrackerConfig::default();
    let try_at = |pose: &Pose, config: &ObjectTrackerConfig| {
        ObjectTracker::new(
            &frame.frame,
            &frame.world_from_camera,
            model(&thing),
            None,
            pose,
            SensorModel::kinect(),
            config,
        )
        .map(|_| ())
    };
    let behind = Pose::new([0.0, -9.0, 1.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert!(matches!(try_at(&behind, &config), Err(Error::NotSeen { .. })));
    let beside = Pose::new([9.0, 3.0, 1.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert!(matches!(try_at(&beside, &config), Err(Error::TargetSize { .. })));
    let mut wrong = ObjectTrackerConfig::default();
    wrong.rest_angle = f64::NAN;
    let refused = try_at(&thing.world_from_object, &wrong).unwrap_err().to_string();
    assert!(refused.starts_with("tracking.rest_angle = NaN"), "{refused}");
}

#[test]
fn empty_views_and_strange_detections_do_no_harm() {
    let sequence = sequence(CarriedKind::Box, CarriedMotion::Translation, 40);
    let first = sequence.frame(0).unwrap();
    let mut tracker = start(&first);
    let camera = *first.frame.camera();
    let (width, height) = (camera.width(), camera.height());
    let strange: Vec<Detection> =
        [[-1e30, -1e30, 1e30, 1e30], [5.0, 5.0, 5.0, 5.0], [900.0, 900.0, 950.0, 950.0]]
            .iter()
            .map(|&sides| Detection::new("suitcase", 0.9, sides.try_into().unwrap()).unwrap())
            .collect();
    let mut last = None;
    for i in 1..12 {
        let depth = DepthImage::new(width, height, vec![if i % 2 == 0 { 0.0 } else { 1e30 }; width * height])
            .unwrap();
        let color = dymlm_core::ColorImage::new(width, height, vec![[128; 3]; width * height]).unwrap();
        let blank = Frame::new(0.1 * f64::from(i), camera, depth, Some(color)).unwrap();
        last = Some(tracker.track(&blank, &strange, &first.world_from_camera).unwrap());
    }
    let last = last.unwrap();
    assert_eq!(last.state, ObjectState::Lost);
    assert!(last.covariance.is_none() && last.inliers == 0);
    // It is still in its first place, and is found again.
    let again = Frame::new(2.0, camera, first.frame.depth().clone(), first.frame.color().cloned()).unwrap();
    let found = tracker.track(&again, &first.detections, &first.world_from_camera).unwrap();
    assert_eq!(found.state, ObjectState::Recovered);
    assert!(found.world_from_object.distance(&first.carried.unwrap().world_from_object) < 0.01);
}

#[test]
fn trackers_and_results_go_between_threads() {
    fn check<T: Clone + Send + Sync>() {}
    check::<ObjectTracker>();
    check::<ObjectUpdate>();
    check::<ObjectModel>();
    check::<KcfTracker>();
    check::<OpticalFlow>();
    check::<CornerDetector>();
    check::<PoseRansac>();
    check::<PoseRefiner>();
    check::<Error>();
}

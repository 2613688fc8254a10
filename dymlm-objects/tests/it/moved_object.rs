//! An object that somebody carries and puts down elsewhere.

use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, ObjectId, PinholeCamera, Pose, SensorModel};
use dymlm_objects::{NoPlanes, ObjectConfig, ObjectMapper, ObjectView};

/// A box of 0.4 x 0.3 m at 1.5 m before a wall at 3 m, or the wall alone.
fn frame(time: f64, is_there: bool) -> (Frame, Vec<Detection>) {
    let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap();
    let holds = |u: usize, v: usize| is_there && (125..195).contains(&u) && (94..146).contains(&v);
    let depth = (0..320 * 240).map(|i| if holds(i % 320, i / 320) { 1.5 } else { 3.0 }).collect();
    let frame = Frame::new(time, camera, DepthImage::new(320, 240, depth).unwrap(), None).unwrap();
    let seen = BoundingBox::new(125.0, 94.0, 195.0, 146.0).unwrap();
    let detections = is_there.then(|| Detection::new("microwave", 0.8, seen).unwrap());
    (frame, detections.into_iter().collect())
}

fn observe(mapper: &mut ObjectMapper, time: f64, is_there: bool) {
    let (frame, detections) = frame(time, is_there);
    mapper.insert(&ObjectView::new(&frame, &detections, &Pose::identity()), &NoPlanes).unwrap();
}

fn mapper() -> ObjectMapper {
    let mut mapper = ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect()).unwrap();
    for i in 0..4 {
        observe(&mut mapper, f64::from(i), true);
    }
    mapper
}

#[test]
fn it_moves_with_all_that_is_known_of_it() {
    let mut mapper = mapper();
    let before = mapper.map().objects().next().unwrap().clone();
    // A quarter turn about the vertical, and a step.
    let half = 0.5_f64.sqrt();
    let motion = Pose::new([0.3, -0.2, 1.0], [0.0, half, 0.0, half]).unwrap();
    let moved = mapper.move_object(before.id(), &motion).unwrap();
    let after = mapper.map().object(before.id()).unwrap();
    assert_eq!(after.oriented_box(), moved);
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
    assert!(apart(moved.center(), motion.transform_point(before.oriented_box().center())) < 1e-9);
    assert_eq!((after.label(), after.observations()), (before.label(), before.observations()));
    assert!(apart(after.centroids().mean(), motion.transform_point(before.centroids().mean())) < 1e-6);
    let inside = after.points().filter(|&point| {
        let local = moved.world_from_box().inverse().transform_point(point);
        (0..3).all(|axis| local[axis].abs() <= 0.5 * moved.lengths()[axis] + 0.02)
    });
    assert!(inside.count() * 10 >= after.point_count() * 9);
    assert!(after.point_count() * 10 >= before.point_count() * 7);
    assert_eq!(mapper.move_object(ObjectId::new(99), &motion), None);
    let too_far = Pose::new([0.0, 2e9, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert_eq!(mapper.move_object(before.id(), &too_far), None);
}

#[test]
fn while_it_is_carried_frames_have_no_say_about_it() {
    let (mut held, mut left) = (mapper(), mapper());
    let id = held.map().objects().next().unwrap().id();
    held.hold(id);
    for i in 4..80 {
        observe(&mut held, f64::from(i), false);
        observe(&mut left, f64::from(i), false);
    }
    assert!(left.map().object(id).is_none(), "looked through for long: removed");
    let carried = held.map().object(id).unwrap();
    assert_eq!((carried.observations(), carried.frames_in_view()), (4, 4));
    // Put back, it counts again.
    held.move_object(id, &Pose::identity()).unwrap();
    for i in 80..160 {
        observe(&mut held, f64::from(i), false);
    }
    assert!(held.map().object(id).is_none());
}

/// Regression: what stood in its place was refused for ever.
#[test]
fn what_is_put_where_a_carried_thing_stood_is_an_object_once_that_place_was_free() {
    let everywhere = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
    let mut mapper = mapper();
    let id = mapper.map().objects().next().unwrap().id();
    mapper.hold(id);
    for i in 4..8 {
        observe(&mut mapper, f64::from(i), true);
    }
    assert_eq!(mapper.map().len(), 1, "as long as nothing is known of its place, nothing else is there");

    assert!(mapper.remove_where(everywhere, |object| object.id() == id).is_empty());
    for i in 8..12 {
        observe(&mut mapper, f64::from(i), true);
    }
    let others: Vec<_> = mapper.map().objects().filter(|object| object.id() != id).collect();
    assert_eq!((mapper.map().len(), others.len()), (2, 1));
    assert_eq!((others[0].observations(), mapper.map().object(id).unwrap().observations()), (4, 4));

    // Put down elsewhere, it is there again, and both go on.
    let aside = Pose::new([0.6, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    mapper.move_object(id, &aside).unwrap();
    observe(&mut mapper, 12.0, true);
    assert_eq!(mapper.map().len(), 2);
    // Put back where it stood, they are one.
    mapper.move_object(id, &aside.inverse()).unwrap();
    observe(&mut mapper, 13.0, true);
    assert_eq!(mapper.map().len(), 1);
}

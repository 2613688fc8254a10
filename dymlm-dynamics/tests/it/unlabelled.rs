//! What no detector reports is masked where it stands in space that was free for long.
use std::ops::Range;

use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Pose, SensorModel};
use dymlm_dynamics::{BoxSource, DynamicsConfig, Mover, Preprocessor, SceneKnowledge};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
/// Rim of a silhouette in this image, pixels.
const RIM: usize = 2;

/// Columns, rows and depth of a thing.
type Thing = (Range<usize>, Range<usize>, f32);

/// Things before a wall at 3 m.
fn frame(timestamp: f64, things: &[Thing]) -> Frame {
    let mut depth = vec![3.0; WIDTH * HEIGHT];
    for (columns, rows, z) in things {
        for v in rows.clone() {
            depth[v * WIDTH..(v + 1) * WIDTH][columns.clone()].fill(*z);
        }
    }
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 262.5, 262.5, 159.5, 119.5).unwrap();
    Frame::new(timestamp, camera, DepthImage::new(WIDTH, HEIGHT, depth).unwrap(), None).unwrap()
}

fn preprocessor() -> Preprocessor {
    Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap()
}

/// Preprocesses one frame without a detection, a second after the bare wall was seen, in a world of which
/// this is free.
fn run(things: &[Thing], is_free: impl Fn([f64; 3]) -> bool) -> (Vec<Mover>, Mask) {
    let mut preprocessor = preprocessor();
    let free_space = |place, _| is_free(place);
    let knowledge = SceneKnowledge::default().with_free_space(&free_space);
    for frame in [frame(-1.0, &[]), frame(0.0, things)] {
        preprocessor.process_knowing(&frame, Some(&[]), &Pose::identity(), &knowledge).unwrap();
    }
    assert_eq!(&preprocessor.unproven_mask().inverted(), preprocessor.static_mask());
    (preprocessor.movers().to_vec(), preprocessor.static_mask().clone())
}

fn before_the_wall(place: [f64; 3]) -> bool {
    place[2] < 2.8
}

fn assert_masked(mask: &Mask, (columns, rows, _): &Thing) {
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            let is_thing = columns.contains(&u) && rows.contains(&v);
            let is_near = |along: &Range<usize>, c| c + RIM >= along.start && c < along.end + RIM;
            let is_near = is_near(columns, u) && is_near(rows, v);
            assert!(!is_thing || !mask.at(u, v), "pixel {u}, {v} of the thing is static");
            assert!(is_near || mask.at(u, v), "pixel {u}, {v} of the wall is masked");
        }
    }
}

#[test]
fn what_is_new_in_free_space_is_masked_without_a_detection() {
    let thing = (100..160, 60..180, 2.0);
    let (movers, mask) = run(std::slice::from_ref(&thing), before_the_wall);
    assert_masked(&mask, &thing);
    assert_eq!(movers.len(), 1);
    assert_eq!((movers[0].label.as_deref(), movers[0].source), (None, BoxSource::FreeSpace));
    assert_eq!(movers[0].depth, Some(2.0));
    let truth = BoundingBox::new(100.0, 60.0, 160.0, 180.0).unwrap();
    assert!(movers[0].bounding_box.iou(&truth) > 0.9, "{:?}", movers[0].bounding_box);
}

#[test]
fn nothing_is_new_where_space_is_not_known_to_be_free() {
    let (movers, mask) = run(&[(100..160, 60..180, 2.0)], |_| false);
    assert!(movers.is_empty());
    assert_eq!(mask.count(), WIDTH * HEIGHT);
}

/// What a map knows of free space may be of a time when the poses had drifted elsewhere: then a wall that is
/// met again stands in it.
#[test]
fn nothing_is_new_where_nobody_has_looked_through_lately() {
    let mut preprocessor = preprocessor();
    let free_space = |place, _| before_the_wall(place);
    let knowledge = SceneKnowledge::default().with_free_space(&free_space);
    let wall = frame(0.0, &[(0..WIDTH, 0..HEIGHT, 2.0)]);
    let away = Pose::new([0.0; 3], [0.0, 1.0, 0.0, 0.0]).unwrap();
    preprocessor.process_knowing(&frame(-1.0, &[]), Some(&[]), &away, &knowledge).unwrap();
    let result = preprocessor.process_knowing(&wall, Some(&[]), &Pose::identity(), &knowledge).unwrap();
    assert!(result.movers.is_empty());
    assert_eq!(result.static_mask.count(), WIDTH * HEIGHT);
}

#[test]
fn a_thing_goes_whole_though_half_of_it_stands_where_nothing_is_known() {
    let thing = (100..160, 60..180, 2.0);
    let middle = (130.0 - 159.5) / 262.5 * 2.0;
    let (movers, mask) =
        run(std::slice::from_ref(&thing), |place| before_the_wall(place) && place[0] < middle);
    assert_masked(&mask, &thing);
    assert_eq!(movers.len(), 1);
}

/// A long thing of which a little is known to be new is found beyond the search's margin too.
#[test]
fn a_long_thing_goes_whole() {
    // Wavy, so that it is no plane that goes on around the box.
    let column = |u: usize| (u..u + 1, 90..150, 2.0 + 0.04 * (u as f32 / 6.0).sin());
    let things: Vec<Thing> = (40..190).map(column).collect();
    let end = (140.0 - 159.5) / 262.5 * 2.0;
    let (movers, mask) = run(&things, |place| before_the_wall(place) && place[0] < end);
    assert_eq!(movers.len(), 1);
    assert_masked(&mask, &(40..190, 90..150, 2.0));
}

#[test]
fn flying_pixels_and_specks_are_nothing_new() {
    let lines = (0..5).map(|line| (60 + 20 * line..62 + 20 * line, 40..200, 2.0 + 0.1 * line as f32));
    let specks = (0..5).map(|speck| (200..206, 30 + 40 * speck..36 + 40 * speck, 1.5));
    let (movers, mask) = run(&lines.chain(specks).collect::<Vec<_>>(), before_the_wall);
    assert!(movers.is_empty(), "{movers:?}");
    assert_eq!(mask.count(), WIDTH * HEIGHT);
}

#[test]
fn who_is_detected_is_no_second_mover_and_ids_are_used_once() {
    let mut preprocessor = preprocessor();
    let free_space = |place, _| before_the_wall(place);
    let knowledge = SceneKnowledge::default().with_free_space(&free_space);
    let mut ids = Vec::new();
    preprocessor.process_knowing(&frame(-1.0, &[]), Some(&[]), &Pose::identity(), &knowledge).unwrap();
    for step in 0..5_usize {
        let (person, trolley) = ((60..100, 40..200, 2.0), (200 + 2 * step..260 + 2 * step, 120..200, 2.2));
        let found = BoundingBox::new(60.0, 40.0, 100.0, 200.0).unwrap();
        let found = [Detection::new("person", 0.9, found).unwrap()];
        let frame = frame(step as f64 / 30.0, &[person, trolley]);
        let result =
            preprocessor.process_knowing(&frame, Some(&found), &Pose::identity(), &knowledge).unwrap();
        let labels: Vec<_> = result.movers.iter().map(|mover| mover.label.as_deref()).collect();
        assert_eq!(labels, [Some("person"), None]);
        ids.push(result.movers.iter().map(|mover| mover.track_id).collect::<Vec<_>>());
    }
    assert!(ids[0][0] != ids[0][1]);
    assert!(ids.iter().all(|frame| *frame == ids[0]), "{ids:?}");
}

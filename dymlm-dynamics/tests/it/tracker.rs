//! Behaviour of the box tracker.
use dymlm_core::{BoundingBox, Detection, PinholeCamera, Pose, TrackId};
use dymlm_dynamics::{BoxSource, BoxTracker, Error, TrackState, TrackedBox, TrackerConfig, View};
use proptest::prelude::*;

fn detection(label: &str, score: f32, [x, y, width, height]: [f32; 4]) -> Detection {
    Detection::new(label, score, BoundingBox::new(x, y, x + width, y + height).unwrap()).unwrap()
}

fn person(x: f32) -> Detection {
    detection("person", 0.9, [x, 50.0, 60.0, 200.0])
}

fn tracker() -> BoxTracker {
    BoxTracker::new(TrackerConfig::default()).unwrap()
}

fn ids(boxes: &[TrackedBox]) -> Vec<u64> {
    boxes.iter().map(|tracked| tracked.track_id.get()).collect()
}

#[test]
fn a_track_is_confirmed_coasts_and_is_found_again() {
    let mut tracker = tracker();
    for frame in 0_u8..4 {
        let boxes = tracker.update(f64::from(frame) * 0.1, &[person(f32::from(frame) * 8.0)], None).unwrap();
        let expected = if frame == 0 { TrackState::Tentative } else { TrackState::Confirmed };
        assert_eq!((ids(boxes), boxes[0].state), (vec![0], expected));
        assert_eq!(boxes[0].source, BoxSource::Detected { detection: 0 });
    }
    // 0.5 s of coasting: five frames, no more.
    for frame in 4_u8..9 {
        let boxes = tracker.update(f64::from(frame) * 0.1, &[], None).unwrap();
        let BoxSource::Predicted { missed_for } = boxes[0].source else { panic!("not predicted") };
        assert!((missed_for - f64::from(frame - 3) * 0.1).abs() < 1e-9);
        assert!((boxes[0].bounding_box.x_min() - f32::from(frame) * 8.0).abs() < 2.0);
    }
    assert!(tracker.update(0.9, &[], None).unwrap().is_empty());
    assert_eq!(ids(tracker.update(1.0, &[person(80.0)], None).unwrap()), [0]);
    // Out of sight for longer than it is remembered.
    assert_eq!(ids(tracker.update(2.2, &[person(90.0)], None).unwrap()), [1]);
}

#[test]
fn a_track_seen_once_does_not_coast() {
    let mut tracker = tracker();
    tracker.update(0.0, &[person(0.0)], None).unwrap();
    assert!(tracker.update(0.1, &[], None).unwrap().is_empty());
}

#[test]
fn zero_coasting_is_none() {
    let mut config = TrackerConfig::default();
    config.max_coast = 0.0;
    let mut tracker = BoxTracker::new(config).unwrap();
    for frame in 0_u8..3 {
        tracker.update(f64::from(frame), &[person(0.0)], None).unwrap();
    }
    // Not even in a frame of the same time.
    assert!(tracker.update(2.0, &[], None).unwrap().is_empty());
}

#[test]
fn scores_decide_what_a_detection_may_do() {
    let at = |score: f32| [detection("person", score, [0.0, 0.0, 60.0, 200.0])];
    let mut tracker = tracker();
    assert!(tracker.update(0.0, &at(0.2), None).unwrap().is_empty(), "too weak to start a track");
    assert_eq!(ids(tracker.update(0.1, &at(0.3), None).unwrap()), [0]);
    assert_eq!(ids(tracker.update(0.2, &at(0.15), None).unwrap()), [0], "a weak one goes on with it");
    assert_eq!(tracker.boxes()[0].source, BoxSource::Detected { detection: 0 });
    tracker.update(0.3, &at(0.05), None).unwrap();
    assert!(matches!(tracker.boxes()[0].source, BoxSource::Predicted { .. }), "below 0.1 it is ignored");
}

#[test]
fn strong_detections_are_served_first() {
    let mut tracker = tracker();
    tracker.update(0.0, &[detection("person", 0.9, [0.0, 0.0, 60.0, 200.0])], None).unwrap();
    // The weak box fits better; the strong one is taken all the same, and the weak one starts a track.
    let weak = detection("person", 0.3, [0.0, 0.0, 60.0, 200.0]);
    let strong = detection("person", 0.8, [20.0, 0.0, 60.0, 200.0]);
    let boxes = tracker.update(0.1, &[weak, strong], None).unwrap();
    assert_eq!(boxes[0].source, BoxSource::Detected { detection: 1 });
    assert_eq!((boxes[1].track_id.get(), boxes[1].source), (1, BoxSource::Detected { detection: 0 }));
}

#[test]
fn labels_do_not_mix() {
    let mut tracker = tracker();
    let place = [0.0, 0.0, 60.0, 200.0];
    tracker.update(0.0, &[detection("person", 0.9, place)], None).unwrap();
    let boxes = tracker.update(0.1, &[detection("dog", 0.9, place)], None).unwrap();
    assert_eq!((boxes.len(), boxes[0].track_id.get(), &*boxes[0].label), (1, 1, "dog"));
}

/// The camera turns and moves; a person stands still. Without the poses the box jumps too far to be matched.
#[test]
fn the_camera_s_own_motion_is_undone() {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let seen_from = |world_from_camera: &Pose| {
        let camera_from_world = world_from_camera.inverse();
        let [left, top] = camera.project(camera_from_world.transform_point([-0.2, -0.8, 2.0])).unwrap();
        let [right, bottom] = camera.project(camera_from_world.transform_point([0.2, 0.8, 2.0])).unwrap();
        detection("person", 0.9, [left as f32, top as f32, (right - left) as f32, (bottom - top) as f32])
    };
    // 12 degrees and 15 cm a frame.
    let pose = |frame: f64| {
        let half = 0.5 * (0.2 * frame - 0.3);
        Pose::new([0.1 * frame, 0.0, 0.1 * frame], [0.0, half.sin(), 0.0, half.cos()]).unwrap()
    };
    let run = |compensate: bool, depth: Option<f32>| {
        let mut tracker = tracker();
        let mut last = Vec::new();
        for frame in 0_u8..4 {
            let view = View { camera, world_from_camera: pose(f64::from(frame)) };
            let boxes = tracker
                .update(
                    f64::from(frame) / 6.0,
                    &[seen_from(&view.world_from_camera)],
                    compensate.then_some(&view),
                )
                .unwrap();
            last = ids(boxes);
            if let Some(depth) = depth {
                let z = view.world_from_camera.inverse().transform_point([0.0, 0.0, depth.into()])[2] as f32;
                tracker.observe_depth(TrackId::new(last[0]), z);
            }
        }
        last
    };
    assert_eq!(run(true, Some(2.0)), [0]);
    assert_ne!(run(false, None), [0], "the scene must be hard enough to show something");
    // Rotation alone, undone without a depth, already is enough to follow it.
    assert_eq!(run(true, None), [0]);
}

#[test]
fn expected_depth_follows_the_camera() {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut tracker = tracker();
    let view =
        |z: f64| View { camera, world_from_camera: Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap() };
    let middle = [detection("person", 0.9, [289.5, 139.5, 60.0, 200.0])];
    tracker.update(0.0, &middle, Some(&view(0.0))).unwrap();
    tracker.observe_depth(TrackId::new(0), 3.0);
    tracker.observe_depth(TrackId::new(0), f32::NAN);
    tracker.observe_depth(TrackId::new(0), 0.0);
    tracker.observe_depth(TrackId::new(77), 1.0);
    tracker.update(0.1, &middle, Some(&view(0.5))).unwrap();
    assert!((tracker.boxes()[0].expected_depth.unwrap() - 2.5).abs() < 1e-6);
}

/// Half a metre wide and 1.7 m tall, at a depth and so far to the right of the camera, metres.
fn walker([right, depth]: [f32; 2]) -> [f32; 4] {
    let [left, top, end, bottom] = [right - 0.25, -1.0, right + 0.25, 0.7].map(|c| 525.0 * c / depth);
    let (left, end) = ((319.5 + left).clamp(0.0, 640.0), (319.5 + end).clamp(0.0, 640.0));
    let (top, bottom) = ((239.5 + top).clamp(0.0, 480.0), (239.5 + bottom).clamp(0.0, 480.0));
    [left, top, end - left, bottom - top]
}

/// Who walks away becomes smaller by half from one frame to the next: the trend of the area would make them
/// vanish. The detector runs five times, twice and once a second.
#[test]
fn who_walks_away_stays_one_track_at_every_frame_rate() {
    for (rate, start, speed) in [5.0, 2.0, 1.0]
        .into_iter()
        .flat_map(|rate| [1.5, 2.0, 2.5, 3.0].map(|start| (rate, start)))
        .flat_map(|(rate, start)| [0.7, 0.8, 0.9, 1.0, 1.1, 1.2].map(|speed| (rate, start, speed)))
    {
        let mut tracker = tracker();
        let place = |time: f32| walker([0.1, start + speed * time]);
        let times = || (0_u8..).map(|step| f32::from(step) / rate).take_while(|&time| time <= 4.0);
        for time in times() {
            let found = [detection("person", 0.9, place(time))];
            let boxes = tracker.update(time.into(), &found, None).unwrap();
            assert_eq!(ids(boxes), [0], "{rate} Hz, from {start} m at {speed} m/s, after {time} s");
        }
        // Missed once, they are about where they were seen to go; the filter's trend lags behind.
        let time = 4.0 + 1.0 / rate;
        let boxes = tracker.update(time.into(), &[], None).unwrap();
        let [x, y, width, height] = place(time);
        let there = BoundingBox::new(x, y, x + width, y + height).unwrap();
        assert!(boxes[0].bounding_box.iou(&there) > 0.4, "{rate} Hz: {:?} {there:?}", boxes[0]);
    }
}

/// At one frame a second, upright and with the camera on its side.
#[test]
fn who_walks_across_the_view_stays_one_track_whichever_way_up_the_camera_is() {
    for speed in [0.3, 0.5, 0.8, 1.1] {
        for is_on_side in [false, true] {
            let mut tracker = tracker();
            for step in 0_u8..4 {
                let [x, y, width, height] = walker([-0.8 + speed * f32::from(step), 2.5]);
                let place = if is_on_side { [y, x, height, width] } else { [x, y, width, height] };
                let boxes = tracker.update(step.into(), &[detection("person", 0.9, place)], None).unwrap();
                assert_eq!(ids(boxes), [0], "{speed} m/s, on its side: {is_on_side}, frame {step}");
            }
        }
    }
}

/// A detector at half a hertz and one that is a little late do not make a pause.
#[test]
fn a_slow_detector_may_miss_somebody_once() {
    for interval in [1.002, 2.0, 5.0] {
        let mut tracker = tracker();
        for step in 0_u8..8 {
            let found = [person(f32::from(step) * 5.0)];
            let found = if step % 3 == 2 { &[][..] } else { &found[..] };
            let boxes = tracker.update(interval * f64::from(step), found, None).unwrap();
            assert_eq!(ids(boxes), [0], "{interval} s, look {step}");
        }
        // A minute later they are somebody else, and nobody is predicted from before.
        let time = interval * 7.0 + 60.0;
        assert!(tracker.update(time, &[], None).unwrap().is_empty(), "{interval} s");
    }
}

/// The detector's second look comes after two seconds: until then nobody knows its pace.
#[test]
fn who_is_seen_in_the_first_look_is_still_known_in_the_second() {
    for wait in [0.8, 2.0, 5.0] {
        let mut tracker = tracker();
        tracker.update(0.0, &[person(0.0)], None).unwrap();
        for time in (1..).map(|frame| f64::from(frame) / 30.0).take_while(|&time| time < wait) {
            assert_eq!(ids(tracker.predict(time, None).unwrap()), [0], "{wait} s, after {time} s");
        }
        assert_eq!(ids(tracker.update(wait, &[person(20.0)], None).unwrap()), [0], "{wait} s");
    }
}

#[test]
fn who_was_seen_once_is_not_waited_for_for_ever() {
    let mut tracker = tracker();
    tracker.update(0.0, &[person(0.0)], None).unwrap();
    assert_eq!(ids(tracker.predict(4.9, None).unwrap()), [0]);
    assert!(tracker.predict(5.1, None).unwrap().is_empty());
    tracker.predict(61.0, None).unwrap();
    assert_eq!(ids(tracker.update(62.0, &[person(0.0)], None).unwrap()), [1]);
}

/// Regression: who stood there an hour ago lent the newcomer an id and a depth.
#[test]
fn after_a_pause_in_the_frames_nobody_is_known() {
    let mut tracker = tracker();
    for tenth in 0_u8..10 {
        tracker.update(f64::from(tenth) / 10.0, &[person(0.0)], None).unwrap();
    }
    tracker.observe_depth(TrackId::new(0), 2.5);
    let boxes = tracker.update(3600.0, &[person(0.0)], None).unwrap();
    assert_eq!((ids(boxes), boxes[0].expected_depth), (vec![1], None));
}

/// Regression: no time between two results was taken for the detector's pace, and tracks were forgotten
/// between its looks.
#[test]
fn a_look_that_is_given_twice_is_one_look() {
    let run = |copies: usize| {
        let mut tracker = tracker();
        let mut counts = Vec::new();
        for tenth in 0_u8..100 {
            let time = f64::from(tenth) / 10.0;
            if tenth % 20 == 0 {
                (0..copies).for_each(|_| _ = tracker.update(time, &[person(0.0)], None).unwrap());
            } else {
                tracker.predict(time, None).unwrap();
            }
            counts.push(tracker.boxes().len());
        }
        counts
    };
    assert_eq!(run(2), run(1));
}

/// The detector runs twice a minute. Where somebody is says nothing any more after some seconds, but who is
/// found in the next look may be the one of the last.
#[test]
fn a_very_slow_detector_s_boxes_are_not_predicted_for_a_minute() {
    let mut tracker = tracker();
    for look in 0_u8..4 {
        let begin = 30.0 * f64::from(look);
        // The third look misses them.
        let found = if look == 2 { vec![] } else { vec![person(0.0)] };
        let expected: &[u64] = if look == 2 { &[] } else { &[0] };
        assert_eq!(ids(tracker.update(begin, &found, None).unwrap()), expected, "look {look}");
        assert_eq!(ids(tracker.predict(begin + 4.9, None).unwrap()), expected, "look {look}");
        for later in [5.1, 10.0, 29.0] {
            assert!(tracker.predict(begin + later, None).unwrap().is_empty(), "look {look}, {later} s");
        }
    }
}

#[test]
fn refused_times_change_nothing() {
    let mut tracker = tracker();
    tracker.update(5.0, &[person(0.0)], None).unwrap();
    tracker.update(5.1, &[person(4.0)], None).unwrap();
    let before = format!("{tracker:?}");
    for timestamp in [5.0, f64::NEG_INFINITY] {
        assert!(tracker.update(timestamp, &[person(8.0)], None).is_err());
    }
    assert_eq!(tracker.update(5.0, &[], None), Err(Error::TimeReversed { previous: 5.1, timestamp: 5.0 }));
    for timestamp in [f64::NAN, f64::INFINITY, 1.7e12] {
        assert!(matches!(tracker.update(timestamp, &[person(8.0)], None), Err(Error::Timestamp(_))));
    }
    assert_eq!(format!("{tracker:?}"), before);
    // The same time again is a step of no duration.
    assert_eq!(ids(tracker.update(5.1, &[person(4.0)], None).unwrap()), [0]);
}

#[test]
fn odd_boxes_are_no_trouble() {
    let mut tracker = tracker();
    let odd = [
        detection("person", 0.9, [10.0, 10.0, 0.0, 50.0]),
        detection("person", 0.9, [-1e38, -1e38, 2e38, 2e38]),
        detection("person", 0.9, [1e38, 1e38, 1e30, 1e30]),
        detection("person", 0.9, [-500.0, -500.0, 10.0, 10.0]),
        detection("person", 0.9, [0.0, 0.0, 1e-20, 1e-20]),
    ];
    for frame in 0_u8..10 {
        let boxes = tracker.update(f64::from(frame) * 0.1, &odd, None).unwrap();
        assert!(boxes.iter().all(|tracked| tracked.bounding_box.width() > 0.0));
    }
    for frame in 10_u8..16 {
        tracker.update(f64::from(frame) * 0.1, &[], None).unwrap();
    }
}

#[test]
fn settings_are_checked() {
    let mut config = TrackerConfig::default();
    config.min_iou = 1.5;
    let error = BoxTracker::new(config).unwrap_err();
    assert_eq!(error.to_string(), "dynamics.tracker.min_iou = 1.5 is outside its range 0..=1");
}

/// Boxes at whole pixels, so that moving all of them rounds nothing.
fn frames() -> impl Strategy<Value = Vec<Vec<(u8, [u8; 4])>>> {
    let one = (0_u8..100, [0_u8..100, 0_u8..100, 20_u8..60, 20_u8..60]);
    proptest::collection::vec(proptest::collection::vec(one, 0..6), 1..6)
}

fn detections(frame: &[(u8, [u8; 4])], shift: f32) -> Vec<Detection> {
    let make = |&(score, [x, y, width, height]): &(u8, [u8; 4])| {
        let [x, y, width, height] = [x, y, width, height].map(f32::from);
        detection("person", f32::from(score) / 100.0, [x + shift, y + shift, width, height])
    };
    frame.iter().map(make).collect()
}

proptest! {
    #[test]
    fn all_boxes_moved_alike_give_the_same_tracks(frames in frames(), shift in -4000_i16..4000) {
        let (mut here, mut there) = (tracker(), tracker());
        for (index, frame) in frames.iter().enumerate() {
            let time = index as f64 / 6.0;
            let here = here.update(time, &detections(frame, 0.0), None).unwrap();
            let there = there.update(time, &detections(frame, shift.into()), None).unwrap();
            let key = |tracked: &TrackedBox| (tracked.track_id, tracked.source);
            prop_assert_eq!(
                here.iter().map(key).collect::<Vec<_>>(),
                there.iter().map(key).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn the_order_of_detections_does_not_matter(frames in frames()) {
        let (mut forward, mut backward) = (tracker(), tracker());
        for (index, frame) in frames.iter().enumerate() {
            let time = index as f64 / 6.0;
            let detections = detections(frame, 0.0);
            let reversed: Vec<Detection> = detections.iter().rev().cloned().collect();
            let forward = forward.update(time, &detections, None).unwrap();
            let backward = backward.update(time, &reversed, None).unwrap();
            let key = |tracked: &TrackedBox| (tracked.track_id, <[f32; 4]>::from(tracked.bounding_box));
            prop_assert_eq!(
                forward.iter().map(key).collect::<Vec<_>>(),
                backward.iter().map(key).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn every_good_detection_is_output_once(frames in frames()) {
        let mut tracker = tracker();
        for (index, frame) in frames.iter().enumerate() {
            let detections = detections(frame, 0.0);
            let boxes = tracker.update(index as f64 / 6.0, &detections, None).unwrap();
            for (wanted, detection) in detections.iter().enumerate() {
                let times = boxes.iter().filter(|b| b.source == BoxSource::Detected { detection: wanted }).count();
                prop_assert!(times <= 1);
                prop_assert!(times == 1 || detection.score() < 0.25);
            }
            prop_assert!(boxes.windows(2).all(|pair| pair[0].track_id < pair[1].track_id));
        }
    }
}

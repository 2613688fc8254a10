//! Frames with more detections than there is room for: their cost grows with their number, up to a limit.
use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_dynamics::{BoxSource, BoxTracker, DynamicsConfig, Error, Preprocessor, TrackerConfig};
use dymlm_test_support::growth;

fn frame(timestamp: f64) -> Frame {
    let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap();
    let depth = (0..320 * 240).map(|i| if (i / 20) % 3 == 0 { 2.0 } else { 3.0 }).collect();
    Frame::new(timestamp, camera, DepthImage::new(320, 240, depth).unwrap(), None).unwrap()
}

/// People side by side and above each other, 20 a row, `moved` pixels to the right.
fn people(count: usize, moved: f32, score: f32) -> Vec<Detection> {
    let person = |i: usize| {
        let (x, y) = ((i % 20) as f32 * 15.0 + moved, (i / 20) as f32 * 14.0);
        Detection::new("person", score, BoundingBox::new(x, y, x + 14.0, y + 13.0).unwrap()).unwrap()
    };
    (0..count).map(person).collect()
}

fn preprocessor(max_coast: f64) -> Preprocessor {
    let mut config = DynamicsConfig::default();
    config.tracker.max_coast = max_coast;
    Preprocessor::new(config, SensorModel::kinect()).unwrap()
}

#[test]
fn a_detection_costs_the_same_among_many_as_among_few() {
    const MOST: f64 = 14.0;
    let [few, many] = [37, 296].map(|count| people(count, 0.0, 0.9));
    let times = growth(MOST, &few, &many, |people| {
        let mut preprocessor = preprocessor(0.5);
        for timestamp in [0.0, 0.03] {
            preprocessor.process(&frame(timestamp), Some(people), &Pose::identity()).unwrap();
        }
    });
    assert!(times <= MOST, "8 times the people took {times} times as long");
}

#[test]
fn more_detections_than_a_detector_gives_are_refused_and_change_nothing() {
    let max = Preprocessor::MAX_DETECTIONS;
    let mut preprocessor = preprocessor(0.5);
    let pose = Pose::identity();
    preprocessor.process(&frame(0.0), Some(&people(2, 0.0, 0.9)), &pose).unwrap();
    let before = (preprocessor.movers().to_vec(), preprocessor.static_mask().clone());
    let refused = preprocessor.process(&frame(0.1), Some(&people(max + 1, 0.0, 0.9)), &pose).unwrap_err();
    assert_eq!(refused, Error::TooManyDetections { given: max + 1, max });
    assert_eq!((preprocessor.movers(), preprocessor.static_mask()), (before.0.as_slice(), &before.1));
    // An older one is still taken, and so are as many as allowed. What is ignored does not count.
    preprocessor.process(&frame(0.05), Some(&people(max, 0.0, 0.9)), &pose).unwrap();
    preprocessor.process(&frame(0.1), Some(&people(2 * max, 0.0, 0.05)), &pose).unwrap();
}

#[test]
fn movers_that_are_missed_do_not_pile_up() {
    let mut preprocessor = preprocessor(60.0);
    // Each is where it was, of one label in the first two frames and of another in the last ones.
    let camera = *frame(0.0).camera();
    let crowd = |label: &str| -> Vec<Detection> {
        let of_label = |detection: &Detection| Detection::new(label, 0.9, detection.bounding_box()).unwrap();
        people(200, 0.0, 0.9).iter().map(of_label).collect()
    };
    let is_body = |i: usize| (2..12).contains(&(i % 320 % 15)) && (2..11).contains(&(i / 320 % 14));
    let depth = (0..320 * 240).map(|i| if is_body(i) { 2.0 } else { 4.0 }).collect();
    let depth = DepthImage::new(320, 240, depth).unwrap();
    for (time, label) in (0_u8..).zip(["person", "person", "dog", "dog"]) {
        let frame = Frame::new(f64::from(time) * 0.05, camera, depth.clone(), None).unwrap();
        preprocessor.process(&frame, Some(&crowd(label)), &Pose::identity()).unwrap();
    }
    let movers = preprocessor.movers();
    let detected = movers.iter().filter(|mover| matches!(mover.source, BoxSource::Detected { .. })).count();
    assert_eq!((detected, movers.len()), (200, Preprocessor::MAX_DETECTIONS));
    assert!(movers.is_sorted_by_key(|mover| mover.track_id));
}

#[test]
fn a_tracker_forgets_what_is_too_much_the_oldest_first() {
    let mut config = TrackerConfig::default();
    (config.max_age, config.max_coast) = (600.0, 60.0);
    let mut tracker = BoxTracker::new(config).unwrap();
    let mut far_away = 0.0;
    for time in 0..12_u8 {
        if time % 2 == 0 {
            far_away += 1000.0;
        }
        tracker.update(f64::from(time) * 0.05, &people(300, far_away, 0.9), None).unwrap();
    }
    // Six crowds of 300, of which three have room, and a hundred of the fourth.
    assert_eq!(tracker.boxes().len(), 1000);
    let oldest = tracker.boxes().iter().map(|tracked| tracked.track_id.get()).min();
    assert_eq!(oldest, Some(600));
}

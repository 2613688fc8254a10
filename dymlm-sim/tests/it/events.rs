//! Events: things that move without a mover's label are in the masks and the swept volume, and the truth is
//! the scene as it stands at the end.
use dymlm_core::{Mask, PinholeCamera, Point};
use dymlm_metrics::SpaceTruth;
use dymlm_sim::{
    Activity, DetectorConfig, SceneEvent, SensorConfig, Sequence, SequenceConfig, SimulatedFrame, Truth,
    TruthConfig,
};

/// The events that have a place in the office; its door is too far away.
const EVENTS: [SceneEvent; 4] =
    [SceneEvent::Trolley, SceneEvent::PushedChair, SceneEvent::PlacedPartition, SceneEvent::RemovedPartition];

/// Small frames without errors; one person sits.
fn with_events(events: &[SceneEvent], random: bool) -> SequenceConfig {
    let mut config = if random { SequenceConfig::random_room(11) } else { SequenceConfig::default() };
    config.camera = Some(PinholeCamera::new(80, 60, 65.6, 65.6, 39.5, 29.5).unwrap());
    (config.frames, config.frame_rate) = (30, 2.0);
    config.sensor = SensorConfig::ideal();
    config.detector = DetectorConfig::ideal();
    (config.people, config.activity) = (1, Activity::Sitting);
    config.events = events.to_vec();
    config
}

/// Number of pixels of the mover mask that show no person.
fn moving(frame: &SimulatedFrame) -> usize {
    let people = frame.visible_things.iter().filter(|thing| thing.label == "person");
    frame.mover_mask.count() - people.map(|thing| thing.pixels).sum::<usize>()
}

fn contains(outer: &Mask, inner: &Mask) -> bool {
    outer.pixels().zip(inner.pixels()).all(|(outer, inner)| outer || !inner)
}

#[test]
fn what_an_event_moves_is_in_the_mask_while_it_moves_and_never_detected_as_a_mover() {
    for event in EVENTS {
        let sequence = Sequence::new(&with_events(&[event], false)).unwrap();
        let times = sequence.changes().first().map_or([0.0, 15.0], |change| change.times);
        for index in (0..sequence.len()).step_by(2) {
            let frame = sequence.frame(index).unwrap();
            let time = frame.frame.timestamp();
            assert!(contains(&frame.transient_mask, &frame.mover_mask));
            assert!((times[0]..times[1]).contains(&time) || moving(&frame) == 0, "{event:?} at {time}");
            let people = frame.detections.iter().filter(|found| found.label() == "person").count();
            assert!(people <= 1, "{event:?}");
        }
        if matches!(event, SceneEvent::Trolley | SceneEvent::PushedChair) {
            let most =
                (0..sequence.len()).map(|index| moving(&sequence.frame(index).unwrap())).max().unwrap();
            assert!(most > 100, "{event:?}: {most} pixels");
        }
    }
}

/// Regression: a chair that was pushed twice was drawn where it never stood.
#[test]
fn each_event_has_a_thing_of_its_own() {
    let twice = |event, random| with_events(&[event, event], random);
    let mut made = 0;
    for seed in 0..20 {
        let mut config = twice(SceneEvent::PushedChair, false);
        (config.seed, config.activity) = (seed, Activity::Walking);
        let Ok(sequence) = Sequence::new(&config) else { continue };
        let changes = sequence.changes();
        assert_ne!(changes[0].id, changes[1].id, "seed {seed}");
        made += 1;
    }
    assert!(made >= 3, "{made} of 20");
    assert!(Sequence::new(&twice(SceneEvent::Trolley, false)).is_err());
    for seed in 0..5 {
        let mut config = twice(SceneEvent::Door, true);
        config.seed = seed;
        assert!(Sequence::new(&config).is_err(), "one door, seed {seed}");
    }
}

/// Regression: the truth was what stands where at a time that no frame shows.
#[test]
fn what_an_event_changes_for_good_is_done_by_the_last_frame() {
    let mut made = 0;
    for seed in 0..20 {
        let mut config = with_events(&[SceneEvent::PushedChair], false);
        // Three seconds.
        (config.seed, config.frames) = (seed, 6);
        let Ok(sequence) = Sequence::new(&config) else { continue };
        assert!(sequence.changes()[0].times[1] <= sequence.timestamp(5), "seed {seed}");
        made += 1;
    }
    assert!(made >= 3, "{made} of 20");
    for event in [SceneEvent::PushedChair, SceneEvent::PlacedPartition, SceneEvent::RemovedPartition] {
        let mut config = with_events(&[event], false);
        config.event_time = Some(100.0);
        assert!(Sequence::new(&config).is_err(), "{event:?}");
    }
}

/// Regression: a negative focal length left no place in view.
#[test]
fn events_happen_before_cameras_with_a_flipped_axis() {
    for event in EVENTS {
        let mut config = with_events(&[event], false);
        let changes = |config: &SequenceConfig| Sequence::new(config).unwrap().changes();
        let upright = changes(&config);
        config.camera = Some(PinholeCamera::new(80, 60, 65.6, -65.6, 39.5, 29.5).unwrap());
        assert_eq!(upright, changes(&config), "{event:?}");
    }
}

/// Regression: it stood in the camera's way and counted as moving.
#[test]
fn no_trolley_rolls_in_a_building() {
    let mut config = SequenceConfig::building(0, 2);
    config.events = vec![SceneEvent::Trolley];
    assert!(Sequence::new(&config).is_err());
}

#[test]
fn a_door_opens_and_closes_again() {
    let rooms = (0..40).map(|seed| {
        let mut config = with_events(&[SceneEvent::Door], true);
        (config.seed, config.event_time) = (seed, Some(3.0));
        Sequence::new(&config)
    });
    let sequence = rooms.flatten().next().unwrap();
    let moving: Vec<usize> = sequence.frames().map(|frame| moving(&frame)).collect();
    // The door takes seven seconds, frames 6 to 20.
    assert!(moving[..6].iter().chain(&moving[20..]).all(|&pixels| pixels == 0), "{moving:?}");
    assert!(moving[6..20].iter().any(|&pixels| pixels > 50), "{moving:?}");
    assert!(sequence.changes().is_empty());
}

#[test]
fn the_truth_is_what_stands_at_the_end_and_traces_are_where_things_were() {
    for random in [false, true] {
        for event in &EVENTS[1..] {
            let sequence = Sequence::new(&with_events(&[*event], random)).unwrap();
            let truth = Truth::of(&sequence, &TruthConfig::default()).unwrap();
            let change = sequence.changes().remove(0);
            assert_eq!(change.before.is_some(), *event != SceneEvent::PlacedPartition);
            assert_eq!(change.after.is_some(), *event != SceneEvent::RemovedPartition);
            let visible = truth.visible_points();
            if let Some(before) = change.before {
                let middle = before.center().map(|c| c as f32);
                assert!(truth.surface_distance(middle) > 0.1, "{event:?}");
                assert!(truth.swept_by_movers(middle) && truth.swept_by_undetected(middle), "{event:?}");
            }
            if let Some(after) = change.after {
                let seen = visible.iter().filter(|point| after.contains(point.map(f64::from))).count();
                assert!(seen > 50, "{event:?}: {seen} points");
                let object = truth.objects().into_iter().find(|object| object.id == change.id);
                assert_eq!(object.is_some(), change.label.is_some());
            }
            // All points that a map is expected to have are on surfaces that stand at the end.
            assert!(visible.iter().all(|&point| truth.surface_distance(point) < 1e-3));
        }
    }
}

#[test]
fn of_a_place_that_nobody_looked_through_again_the_truth_says_so() {
    let sequence = Sequence::new(&with_events(&[SceneEvent::RemovedPartition], false)).unwrap();
    let change = sequence.changes().remove(0);
    let place = change.before.unwrap();
    // In the middle of the panel.
    let [wide, _, high] = place.lengths();
    let inside = (0..100).map(|k| {
        let point = [(f64::from(k % 10) / 10.0 - 0.45) * wide, 0.0, (f64::from(k / 10) / 10.0 - 0.45) * high];
        place.world_from_box().transform_point(point).map(|c| c as f32)
    });
    let inside: Vec<Point> = inside.collect();
    let looked_through = |frames: &mut dyn Iterator<Item = SimulatedFrame>| {
        let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
        frames.for_each(|frame| truth.observe(&frame));
        inside.iter().filter(|&&point| truth.was_looked_through(point)).count()
    };
    let is_after = |frame: &SimulatedFrame| frame.frame.timestamp() >= change.times[1];
    let before = looked_through(&mut sequence.frames().filter(|frame| !is_after(frame)));
    let all = looked_through(&mut sequence.frames());
    assert!(before < 5 && all > 30, "{before} and {all} of 100");
}

#[test]
fn overlooked_people_are_in_the_masks_and_not_among_the_detections() {
    let mut config = with_events(&[], false);
    config.people = 2;
    (config.frames, config.frame_rate) = (6, 1.0);
    for overlooked in 0..=2 {
        config.detector.overlooked_people = overlooked;
        let sequence = Sequence::new(&config).unwrap();
        let frame = sequence.frame(4).unwrap();
        let found = frame.detections.iter().filter(|found| found.label() == "person").count();
        assert_eq!(found, 2 - overlooked);
        assert_eq!(frame.visible_things.iter().filter(|thing| thing.moves).count(), 2);

        let truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
        let (camera, pose) = (frame.frame.camera(), &frame.world_from_camera);
        let mut undetected = 0;
        for (pixel, mover) in frame.mover_mask.pixels().enumerate() {
            let pixel = [(pixel % camera.width()) as f64, (pixel / camera.width()) as f64];
            let depth = frame.true_depth.at(pixel[0] as usize, pixel[1] as usize);
            let point = pose.transform_point(camera.back_project(pixel, depth.into())).map(|c| c as f32);
            assert!(!mover || (truth.swept_by_movers(point) && truth.near_people(point)));
            undetected += usize::from(mover && truth.swept_by_undetected(point));
        }
        let all = frame.mover_mask.count();
        assert!([undetected == 0, (1..all).contains(&undetected), undetected == all][overlooked]);
    }
}

#[test]
fn events_are_drawn_from_the_seed_and_refused_by_name_where_there_is_no_place() {
    let mut config = with_events(&EVENTS, false);
    let first = Sequence::new(&config).unwrap();
    assert_eq!(first.frame(14), Sequence::new(&config).unwrap().frame(14));
    config.seed += 1;
    assert_ne!(first.changes(), Sequence::new(&config).unwrap().changes());
    config.event_time = Some(2.0);
    assert!(Sequence::new(&config).unwrap().changes().iter().all(|change| change.times[0] == 2.0));
    config.events = vec![SceneEvent::Door];
    let error = Sequence::new(&config).unwrap_err().to_string();
    assert!(error.contains("places for an event"), "{error}");
}

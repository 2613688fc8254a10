//! Tests of the rooms and the named sequences: people and things are in view, and a seed always gives the
//! same room.
use std::collections::BTreeSet;

use dymlm_core::{Error, PinholeCamera, Pose};
use dymlm_sim::{
    Activity, CameraPath, DetectorConfig, Room, SensorConfig, Sequence, SequenceConfig, SequenceType,
};

/// A quarter of a Kinect's resolution, without errors.
fn small(mut config: SequenceConfig) -> SequenceConfig {
    config.camera = Some(PinholeCamera::new(160, 120, 131.25, 131.25, 79.5, 59.5).unwrap());
    config.sensor = SensorConfig::ideal();
    config.detector = DetectorConfig::ideal();
    config
}

fn room(room: Room, activity: Activity, seed: u64) -> SequenceConfig {
    let mut config = SequenceConfig::default();
    config.room = room;
    config.activity = activity;
    config.seed = seed;
    config
}

/// What fifteen frames of a sequence show.
#[derive(Debug, Default)]
struct Shown {
    /// Static labelled things with at least 10 pixels in a frame: the smallest view that a detector sees.
    things: BTreeSet<usize>,
    labels: BTreeSet<&'static str>,
    /// Smallest number of such things in a frame.
    fewest: usize,
    /// Number of frames with a person of at least 200 pixels, and with two of them.
    with_people: usize,
    with_both: usize,
    /// Largest share of a frame that shows people.
    most_people: f64,
    /// Smallest share of a frame that shows surfaces within 0.5 to 4 m other than people.
    least_room: f64,
}

fn shown(config: SequenceConfig) -> Shown {
    let sequence = Sequence::new(&small(config)).unwrap();
    let mut shown = Shown { fewest: usize::MAX, least_room: 1.0, ..Shown::default() };
    for index in (0..sequence.len()).step_by(10) {
        let frame = sequence.frame(index).unwrap();
        let still = || frame.visible_things.iter().filter(|thing| !thing.moves && thing.pixels >= 10);
        shown.things.extend(still().map(|thing| thing.id));
        shown.labels.extend(still().map(|thing| thing.label));
        shown.fewest = shown.fewest.min(still().count());
        let people = frame.visible_things.iter().filter(|thing| thing.moves && thing.pixels >= 200).count();
        shown.with_people += usize::from(people > 0);
        shown.with_both += usize::from(people > 1);
        let pixels = 160.0 * 120.0;
        shown.most_people = shown.most_people.max(frame.mover_mask.count() as f64 / pixels);
        let depths = frame.true_depth.data().iter().zip(frame.mover_mask.pixels());
        let near = depths.filter(|&(z, mover)| !mover && (0.5..4.0).contains(z)).count();
        shown.least_room = shown.least_room.min(near as f64 / pixels);
    }
    shown
}

#[test]
fn named_sequences_show_the_desk_and_people() {
    for &kind in SequenceType::ALL {
        let shown = shown(kind.config());
        assert!(shown.things.len() >= 10 && shown.labels.len() >= 7, "{}: {shown:?}", kind.name());
        assert!(shown.fewest >= 4 && shown.least_room > 0.15, "{}: {shown:?}", kind.name());
        match kind.activity() {
            Activity::Sitting => {
                assert!(shown.with_people == 15 && shown.with_both >= 12, "{}: {shown:?}", kind.name());
                assert!(shown.most_people < 0.5, "{}: {shown:?}", kind.name());
            }
            _ => assert!(shown.with_people >= 8 && shown.with_both >= 2, "{}: {shown:?}", kind.name()),
        }
    }
}

#[test]
fn names_tell_what_is_shown() {
    for &kind in SequenceType::ALL {
        let config = kind.config();
        assert_eq!((config.frames, config.frame_rate, config.people), (150, 10.0, 2));
        assert_eq!(config.room, Room::Office);
        let activity = if config.activity == Activity::Sitting { "sitting" } else { "walking" };
        let path = match config.path {
            CameraPath::Static => "static",
            CameraPath::Xyz => "xyz",
            CameraPath::Rpy => "rpy",
            CameraPath::HalfSphere => "halfsphere",
            other => unreachable!("{other:?}"),
        };
        assert_eq!(kind.name(), format!("{activity}_{path}"));
        assert_eq!(kind.label()[..3], format!("{}/{}", &activity[..1], &path[..1]));
    }
    let names: BTreeSet<&str> = SequenceType::ALL.iter().map(|kind| kind.name()).collect();
    let seeds: BTreeSet<u64> = SequenceType::ALL.iter().map(|kind| kind.config().seed).collect();
    assert_eq!((names.len(), seeds.len()), (8, 8));
}

#[test]
fn the_room_of_two_tables_shows_things_and_people() {
    for activity in [Activity::Walking, Activity::Sitting] {
        let shown = shown(room(Room::TwoTables, activity, 7));
        assert!(shown.things.len() >= 12 && shown.fewest >= 3, "{activity:?}: {shown:?}");
        assert!(shown.with_people >= 11 && shown.with_both >= 4, "{activity:?}: {shown:?}");
        assert!(shown.labels.is_superset(&["cup", "bowl", "laptop", "chair", "tv"].into()), "{shown:?}");
    }
}

#[test]
fn random_rooms_show_things_and_people() {
    for seed in 0..10 {
        for activity in [Activity::Walking, Activity::Sitting] {
            let mut config = SequenceConfig::random_room(seed);
            config.activity = activity;
            let shown = shown(config);
            assert!(shown.things.len() >= 8 && shown.labels.len() >= 4, "{seed} {activity:?}: {shown:?}");
            assert!(shown.with_people >= 6 && shown.least_room > 0.05, "{seed} {activity:?}: {shown:?}");
        }
    }
}

#[test]
fn people_are_as_many_as_asked_for() {
    for kind in [Room::Office, Room::TwoTables, Room::Random] {
        for activity in [Activity::Walking, Activity::Sitting] {
            let seen = |people: usize| {
                let mut config = small(room(kind, activity, 4));
                config.people = people;
                let sequence = Sequence::new(&config).unwrap();
                let frames = (0..150).step_by(10).map(|index| sequence.frame(index).unwrap());
                let people = frames.flat_map(|frame| frame.visible_things).filter(|thing| thing.moves);
                people.map(|thing| thing.id).collect::<BTreeSet<usize>>().len()
            };
            assert_eq!([seen(0), seen(1), seen(2)], [0, 1, 2], "{kind:?} {activity:?}");
        }
    }
}

#[test]
fn a_seed_is_a_room() {
    let depth = |seed: u64| {
        let mut config = small(room(Room::Random, Activity::Walking, seed));
        config.people = 0;
        let frame = Sequence::new(&config).unwrap().frame(0).unwrap();
        frame.true_depth.data().iter().map(|z| z.to_bits()).collect::<Vec<u32>>()
    };
    let rooms: BTreeSet<Vec<u32>> = (0..8).map(depth).collect();
    assert_eq!(rooms.len(), 8);
    assert_eq!(depth(3), depth(3));
}

#[test]
fn people_of_other_seeds_do_otherwise() {
    for (kind, activity) in [
        (Room::Office, Activity::Walking),
        (Room::Office, Activity::Sitting),
        (Room::TwoTables, Activity::Walking),
        (Room::TwoTables, Activity::Sitting),
    ] {
        let mask = |seed: u64| {
            Sequence::new(&small(room(kind, activity, seed))).unwrap().frame(20).unwrap().mover_mask
        };
        assert_ne!(mask(1), mask(2), "{kind:?} {activity:?}");
        assert_eq!(mask(1), mask(1));
    }
}

#[test]
fn odd_random_rooms_are_tilted_and_show_the_same_images() {
    let up = |config: &SequenceConfig| config.world_from_scene.rotate([0.0, 0.0, 1.0])[2];
    let tilts: Vec<f64> = (0..40).map(|seed| up(&SequenceConfig::random_room(seed))).collect();
    assert!(tilts.iter().step_by(2).all(|&up| up == 1.0));
    // The rotations are uniform, so about half of the worlds are upside down.
    let below = tilts.iter().skip(1).step_by(2).filter(|&&up| up < 0.0).count();
    assert!((5..=15).contains(&below), "{below} of 20 upside down");

    let tilted = small(SequenceConfig::random_room(3));
    let mut upright = tilted.clone();
    upright.world_from_scene = Pose::identity();
    let frames = [&tilted, &upright].map(|config| Sequence::new(config).unwrap().frame(12).unwrap());
    assert_eq!(frames[0].frame, frames[1].frame);
    assert_eq!(frames[0].true_depth, frames[1].true_depth);
    assert_eq!(frames[0].visible_things, frames[1].visible_things);
    let expected = tilted.world_from_scene * frames[1].world_from_camera;
    assert!(expected.distance(&frames[0].world_from_camera) < 1e-9);
    assert!(expected.angle(&frames[0].world_from_camera) < 1e-6);
}

#[test]
fn what_is_no_config_is_refused_in_every_room() {
    for kind in [Room::Office, Room::TwoTables, Room::Random] {
        for activity in [Activity::Walking, Activity::Sitting] {
            let field = |change: fn(&mut SequenceConfig)| {
                let mut config = room(kind, activity, 1);
                change(&mut config);
                match Sequence::new(&config).unwrap_err() {
                    Error::Config(error) => error.field,
                    other => unreachable!("{other}"),
                }
            };
            assert_eq!(field(|c| c.people = 3), "people");
            assert_eq!(field(|c| c.people = usize::MAX), "people");
            assert_eq!(field(|c| c.frames = 0), "frames");
            assert_eq!(field(|c| c.frame_rate = 0.0), "frame_rate");
            assert_eq!(field(|c| c.frame_rate = f64::INFINITY), "frame_rate");
        }
    }
}

//! Key frames come and go; where the world's origin lies does not matter; the same frames give the same bits.

#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{camera, room, room_views};
use dymlm_core::Pose;
use dymlm_planes::{DetectedPlane, PlaneConfig, PlaneDetector, PlaneMap, PlaneMapConfig};
use proptest::prelude::*;

/// The planes of each view of the room.
fn detections() -> Vec<(Vec<DetectedPlane>, Pose)> {
    let mut detector = PlaneDetector::new(&PlaneConfig::default()).unwrap();
    let views = room_views().into_iter().enumerate();
    views
        .map(|(k, view)| {
            let frame = room().frame(camera(), &view, k as u64);
            (detector.detect(frame.camera(), frame.depth(), None, &[]).unwrap().to_vec(), view)
        })
        .collect()
}

fn map_of(frames: &[(Vec<DetectedPlane>, Pose)]) -> PlaneMap {
    let mut map = PlaneMap::new(PlaneMapConfig::default()).unwrap();
    for (k, (planes, pose)) in frames.iter().enumerate() {
        map.insert(planes, pose, k as f64).unwrap();
    }
    map
}

#[test]
fn the_same_frames_give_the_same_bits() {
    let (first, second) = (detections(), detections());
    assert_eq!(first, second);
    let (first, second) = (map_of(&first), map_of(&second));
    assert_eq!(first.planes(), second.planes());
    let corners =
        |map: &PlaneMap| map.planes().iter().map(dymlm_planes::MapPlane::boundary).collect::<Vec<_>>();
    assert_eq!(corners(&first), corners(&second));
}

#[test]
fn what_most_key_frames_look_past_is_not_confirmed() {
    let frames = detections();
    let (planes, pose) = &frames[0];
    let mut map = PlaneMap::new(PlaneMapConfig::default()).unwrap();
    let mut key_frames = Vec::new();
    for k in 0..3 {
        map.insert(planes, pose, f64::from(k)).unwrap();
    }
    let seen = map.confirmed().count();
    assert!(seen >= 3, "{seen}");
    for k in 3..60 {
        key_frames.push(map.insert(&[], pose, f64::from(k)).unwrap().key_frame);
    }
    // Those whose centroids lie in the middle of the view.
    assert!(map.confirmed().count() < seen);
    for key_frame in key_frames {
        map.remove(key_frame).unwrap();
    }
    assert_eq!(map.confirmed().count(), seen);
    for k in 60..120 {
        map.insert(if k < 77 { planes } else { &[] }, pose, f64::from(k)).unwrap();
    }
    // Seen twenty times it stays, however long the recording.
    assert_eq!(map.confirmed().count(), seen);
}

#[test]
fn a_key_frame_can_be_taken_out_without_a_trace() {
    let frames = detections();
    let mut map = map_of(&frames[..5]);
    let before = map.planes().to_vec();
    let report = map.insert(&frames[5].0, &frames[5].1, 9.0).unwrap();
    assert_ne!(map.planes(), before);
    map.remove(report.key_frame).unwrap();
    assert_eq!(map.planes(), before);
    for key_frame in [3, 0, 4, 2, 1] {
        map.remove(key_frame).unwrap();
    }
    assert!(map.is_empty());
}

#[test]
fn taking_out_a_key_frame_parts_what_it_had_merged() {
    // Two halves of a wall, 0.4 m apart, are two planes until a frame sees the middle; then one is taken out.
    let half = |x: f64| common::World::of(&[common::upright([x, 1.5, 1.0], 0.5, 0.6)]);
    let whole = common::World::of(&[common::upright([0.0, 1.5, 1.0], 1.2, 0.6)]);
    let view = common::look_at([0.0, 0.0, 1.0], [0.0, 1.5, 1.0]);
    let mut detector = PlaneDetector::new(&PlaneConfig::default()).unwrap();
    let mut detect = |world: &common::World| {
        let frame = world.frame(camera(), &view, 3);
        detector.detect(frame.camera(), frame.depth(), None, &[]).unwrap().to_vec()
    };
    let (left, right, all) = (detect(&half(-0.7)), detect(&half(0.7)), detect(&whole));
    let mut map = PlaneMap::new(PlaneMapConfig::default()).unwrap();
    map.insert(&left, &view, 0.0).unwrap();
    map.insert(&right, &view, 1.0).unwrap();
    let before = map.planes().to_vec();
    assert_eq!(before.len(), 2);
    let report = map.insert(&all, &view, 2.0).unwrap();
    assert_eq!((map.len(), report.merged.len()), (1, 1));
    assert_eq!(map.plane(report.merged[0].from), map.plane(report.merged[0].into));
    assert_eq!((map.planes()[0].observations(), map.planes()[0].last_seen()), (3, 2.0));
    map.remove(report.key_frame).unwrap();
    assert_eq!(map.planes(), before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// A rigid motion of the world moves the planes with it, and changes nothing else.
    #[test]
    fn the_map_moves_with_its_world(
        turn in prop::array::uniform4(-1.0..1.0_f64),
        shift in prop::array::uniform3(-500.0..500.0_f64),
    ) {
        let norm = turn.iter().map(|q| q * q).sum::<f64>().sqrt();
        prop_assume!(norm > 0.1);
        let motion = Pose::new(shift, turn.map(|q| q / norm)).unwrap();
        let frames = detections();
        let moved: Vec<_> = frames.iter().map(|(planes, pose)| (planes.clone(), motion * *pose)).collect();
        let (map, other) = (map_of(&frames), map_of(&moved));
        prop_assert_eq!(map.len(), other.len());
        for (a, b) in map.planes().iter().zip(other.planes()) {
            let expected = a.plane().transformed(&motion);
            prop_assert_eq!((a.id(), a.observations()), (b.id(), b.observations()));
            prop_assert!(common::dot(expected.normal(), b.plane().normal()) > 1.0 - 1e-10);
            let centroid = motion.transform_point(a.centroid());
            prop_assert!(common::minus(centroid, b.centroid()).iter().all(|d| d.abs() < 1e-5));
            // Where samples are sparse, the voxels of another frame leave other cells empty.
            prop_assert!((a.area() - b.area()).abs() < 0.1 * a.area() + 0.01, "{} {}", a.area(), b.area());
        }
    }
}

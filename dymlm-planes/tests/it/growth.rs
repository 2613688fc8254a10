//! Memory, and planes of a kilometre: what a key frame adds depends on what it sees.

use crate::common::{World, all_planes, camera, detector, empty_map, level, look_at, snapshot};
use dymlm_core::{Frame, FrameId, Pose, SensorModel};
use dymlm_planes::{DetectedPlane, MapPlane, PlaneConfig, PlaneMap, PlaneMapper};
use dymlm_sim::{Sequence, SequenceConfig};

/// The planes of a frame that looks down at a floor, and the frame.
fn floor() -> (Vec<DetectedPlane>, Frame) {
    let world = World::of(&[level([0.0, 0.0, 0.0], 50.0, 50.0)]);
    let frame = world.frame(camera(), &look_at([0.0, -1.0, 1.4], [0.0, 0.5, 0.0]), 1);
    let planes = detector().detect(&frame, None, &[]).unwrap().to_vec();
    assert_eq!(planes.len(), 1);
    (planes, frame)
}

/// The pose from which that frame sees the floor at a place.
fn over(x: f64, y: f64) -> Pose {
    look_at([x, y - 1.0, 1.4], [x, y + 0.5, 0.0])
}

/// A floor walked from -length / 2 to length / 2 along a direction, a key frame each two metres.
fn walked(length: f64, [along_x, along_y]: [f64; 2]) -> PlaneMap {
    let ((planes, frame), mut map) = (floor(), empty_map());
    for k in 0..=(0.5 * length) as i32 {
        let s = 2.0 * f64::from(k) - 0.5 * length;
        map.insert(&planes, &frame, &over(s * along_x, s * along_y)).unwrap();
    }
    map
}

fn only_plane(map: &PlaneMap) -> &MapPlane {
    let planes = all_planes(map);
    assert_eq!(planes.len(), 1, "{:?}", planes.iter().map(|plane| plane.centroid()).collect::<Vec<_>>());
    planes[0]
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_floor_of_a_kilometre_has_its_area_and_its_outline() {
    let diagonal = [0.8, 0.6];
    let area_of = |map: &PlaneMap| only_plane(map).area();
    let added = area_of(&walked(20.0, diagonal)) - area_of(&walked(10.0, diagonal));
    let map = walked(1200.0, diagonal);
    let (area, boundary) = (area_of(&map), only_plane(&map).boundary());
    assert!((area / (120.0 * added) - 1.0).abs() < 0.02, "{area} m2, 10 m have {added} m2");
    assert_eq!(boundary.len(), 1);
    // Small holes are filled.
    assert!((boundary[0].area() / area - 1.0).abs() < 0.1, "{} of {area}", boundary[0].area());
    // The queries find it at both ends, and a ray from one end to the other meets it there.
    for end in [-500.0, 500.0] {
        let [x, y] = diagonal.map(|part| part * end);
        assert_eq!(map.supports_near([x, y, 0.02], 0.05).count(), 1);
        assert!((map.plane_under([x, y, 0.5], [0.0, 0.0, 1.0], 1.0).unwrap().distance - 0.5).abs() < 0.02);
    }
    let hit = map.cast_ray([-400.0, -300.0, 1.0], [0.8, 0.6, -0.001], f64::INFINITY).unwrap();
    // 1 m lower after 1000 m, but for what the floor leans.
    assert!(hit.distance > 500.0, "{hit:?}");
}

#[test]
fn what_a_key_frame_adds_does_not_depend_on_the_size_of_its_planes() {
    let added = |length: f64| {
        let ((planes, frame), mut map) = (floor(), walked(length, [1.0, 0.0]));
        let before = map.memory_bytes();
        for k in 1..=20 {
            map.insert(&planes, &frame, &over(0.5 * length + f64::from(k), 0.0)).unwrap();
        }
        (map.memory_bytes() - before) / 20
    };
    let (short, long) = (added(20.0), added(400.0));
    assert!(long.abs_diff(short) < short / 20, "{short} and {long} bytes a key frame");
}

#[test]
fn a_key_frame_of_a_room_is_held_in_two_kilobytes() {
    let sequence = Sequence::new(&SequenceConfig::default()).unwrap();
    let mut mapper = PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect()).unwrap();
    let frames: Vec<_> = (0..6).map(|k| sequence.frame(12 * k).unwrap()).collect();
    let mut sizes = vec![mapper.map().memory_bytes()];
    for _ in 0..3 {
        for frame in &frames {
            mapper.insert(&frame.frame, None, &[], &frame.world_from_camera).unwrap();
        }
        sizes.push(mapper.map().memory_bytes());
    }
    // The first time the room itself comes; then only what each key frame has seen.
    let added = sizes.windows(2).map(|pair| (pair[1] - pair[0]) / frames.len()).collect::<Vec<_>>();
    assert!(added[2] < 2000, "{added:?} bytes a key frame");
}

#[test]
fn key_frames_of_a_long_floor_can_be_taken_out() {
    let ((planes, frame), mut map) = (floor(), walked(60.0, [1.0, 0.0]));
    let before = snapshot(&map);
    let report = map.insert(&planes, &frame, &over(5.0, 1.0)).unwrap();
    assert_ne!(snapshot(&map), before);
    map.remove(report.key_frame).unwrap();
    assert_eq!(snapshot(&map), before);
    for k in (0..=30).rev() {
        map.remove(FrameId::new(k)).unwrap();
    }
    assert!(all_planes(&map).is_empty());
    assert!(map.memory_bytes() < 100, "{}", map.memory_bytes());
}

#[test]
fn what_is_far_is_forgotten_as_if_it_had_not_been_seen() {
    let mut map = walked(60.0, [1.0, 0.0]);
    let id = only_plane(&map).id();
    map.forget_outside([10.0, 0.0, 0.0], 8.0);
    let floor = only_plane(&map);
    assert_eq!(floor.id(), id);
    assert!(
        floor.holds([10.0, 0.5, 0.0]) && !floor.holds([-10.0, 0.5, 0.0]) && !floor.holds([25.0, 0.5, 0.0])
    );
    assert!(map.supports_near([-10.0, 0.5, 0.0], 0.1).next().is_none());

    // The key frames that are left see what is left: the same map as of them alone.
    let ((planes, frame), mut near) = (self::floor(), empty_map());
    let is_kept = |x: &i32| map.clone().remove(FrameId::new((x / 2 + 15) as u64)).is_ok();
    let kept: Vec<i32> = (-30..=30).step_by(2).filter(is_kept).collect();
    assert!(kept.len() < 14, "{kept:?}");
    for x in &kept {
        near.insert(&planes, &frame, &over(f64::from(*x), 0.0)).unwrap();
    }
    let (a, b) = (only_plane(&map), only_plane(&near));
    assert_eq!((a.observations(), a.weight(), a.plane()), (b.observations(), b.weight(), b.plane()));
    assert!(a.inlier_points().eq(b.inlier_points()));

    map.forget_outside([1000.0, 0.0, 0.0], 8.0);
    assert!(all_planes(&map).is_empty());
    assert!(map.memory_bytes() < 100, "{}", map.memory_bytes());
}

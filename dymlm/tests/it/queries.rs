//! Questions that more than one map answers: the floor under a camera that never sees its own feet.

use crate::common::fine_camera;
use dymlm::core::vector3::{difference, norm};
use dymlm::core::{Frame, PinholeCamera, Pose};
use dymlm::{MapBuilder, MapConfig, MultiLevelMap};
use dymlm_sim::{Sequence, SequenceConfig};
use dymlm_test_support::{Cylinder, Rectangle, World};

const UP: [f64; 3] = [0.0, 0.0, 1.0];

/// The maps of exact bodies seen from (0, 0, 1.3), looking along y and a little down, in a world that `moved`
/// takes the bodies' to.
fn mapped(world: &World, moved: &Pose) -> MultiLevelMap {
    let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
    let mut builder = MapBuilder::new(MapConfig::offline()).unwrap();
    for step in 0..4 {
        let rows = [[1.0, 0.0, 0.0], [0.0, -0.3, 0.954], [0.0, -0.954, -0.3]];
        let eye = Pose::from_rotation_matrix(rows, [0.02 * f64::from(step), 0.0, 1.3]).unwrap();
        let depth = world.depth(&camera, &eye);
        let frame = Frame::new(f64::from(step), camera, depth, None).unwrap();
        builder.insert(&frame, &[], &(*moved * eye)).unwrap();
    }
    builder.into_map()
}

fn floor() -> World {
    World::of(&[Rectangle::level([0.0; 3], 4.0, 4.0)])
}

#[test]
fn the_floor_goes_on_to_the_feet_of_the_camera() {
    let map = mapped(&floor(), &Pose::identity());
    let eye = [0.0, 0.0, 1.3];
    assert_eq!(map.planes().plane_under(eye, UP, 3.0), None);
    let under = map.floor_under(eye, UP, 3.0, 3.0).unwrap();
    assert!((under.distance - 1.3).abs() < 0.01 && norm(difference(under.point, [0.0; 3])) < 0.01);
    // The image ends 1.33 m before the feet.
    assert!((1.2..1.5).contains(&under.extended_by), "{under:?}");
    let ahead = map.floor_under([0.0, 2.5, 1.0], UP, 3.0, 3.0).unwrap();
    assert!(ahead.extended_by == 0.0 && (ahead.distance - 1.0).abs() < 0.01);
    // At the feet, where the plane is as often above the point as below it.
    for height in [-0.04, -0.002, 0.0, 0.002] {
        let on_it = map.floor_under([0.0, 2.5, height], UP, 3.0, 3.0).unwrap();
        assert!(on_it.plane == ahead.plane && on_it.distance < 0.01, "{height}: {on_it:?}");
    }
    assert_eq!(map.floor_under([0.0, 2.5, 0.0], UP, -0.01, 3.0), None);
    // Out of reach, too low, and over the floor.
    assert_eq!(map.floor_under(eye, UP, 3.0, 1.0), None);
    assert_eq!(map.floor_under(eye, UP, 1.0, 3.0), None);
    assert_eq!(map.floor_under([0.0, 2.5, -0.5], UP, 3.0, 3.0), None);
}

#[test]
fn a_landing_does_not_go_on_where_one_looks_past_its_edge() {
    // A landing up to y = 2, and a floor 0.4 m lower, which its edge occludes up to y = 2.6.
    let landing = Rectangle::level([0.0, 0.5, 0.0], 2.0, 1.5);
    let map = mapped(&World::of(&[landing, Rectangle::level([0.0, 3.0, -0.4], 4.0, 4.0)]), &Pose::identity());
    let before = map.floor_under([0.0, 0.8, 1.0], UP, 3.0, 3.0).unwrap();
    assert!((before.distance - 1.0).abs() < 0.02 && before.extended_by > 0.3, "{before:?}");
    let beyond = map.floor_under([0.0, 2.35, 1.0], UP, 3.0, 3.0).unwrap();
    assert!((beyond.distance - 1.4).abs() < 0.02 && beyond.extended_by > 0.2, "{beyond:?}");
}

#[test]
fn nothing_goes_on_behind_what_stands_between() {
    let post = Cylinder { foot: [0.0, 2.0, 0.0], radius: 0.25, height: 0.7 };
    let world = World { cylinders: vec![post], ..floor() };
    let map = mapped(&world, &Pose::identity());
    assert!(map.floor_under([0.0, 2.0, 1.2], UP, 3.0, 3.0).is_none());
    // Straight down on what was read of it.
    assert!(map.floor_under([0.0, 1.76, 1.2], UP, 3.0, 3.0).is_none_or(|under| under.extended_by == 0.0));
    let free = mapped(&floor(), &Pose::identity());
    assert!(free.floor_under([0.0, 2.0, 1.2], UP, 3.0, 3.0).is_some());
}

#[test]
fn the_floor_turns_with_the_world() {
    let moved = Pose::new([3.0, -20.0, 7.0], [0.5, -0.1, 0.7, 0.5]).unwrap();
    let (map, other) = (mapped(&floor(), &Pose::identity()), mapped(&floor(), &moved));
    for place in [[0.0, 0.0, 1.3], [0.3, 1.0, 0.4], [0.0, 2.0, 1.0]] {
        let one = map.floor_under(place, UP, 3.0, 3.0).unwrap();
        let two = other.floor_under(moved.transform_point(place), moved.rotate(UP), 3.0, 3.0).unwrap();
        assert!(norm(difference(moved.transform_point(one.point), two.point)) < 0.01);
        assert!((one.extended_by - two.extended_by).abs() < 0.05, "{one:?} {two:?}");
    }
}

/// A room with chairs, whose seats are level planes nearer to the camera than the floor that it reads.
#[test]
fn seats_are_not_taken_for_the_floor() {
    let mut config = SequenceConfig::random_room(6);
    (config.frames, config.frame_rate) = (50, 5.0);
    config.camera = Some(fine_camera());
    let mut map_config = MapConfig::default();
    map_config.cloud.voxel_size = 0.02;
    let mut builder = MapBuilder::new(map_config).unwrap();
    let (mut asked, mut found) = (0, 0);
    for frame in Sequence::new(&config).unwrap().frames() {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        let eye = frame.world_from_camera.translation();
        asked += 1;
        if let Some(under) = builder.map().floor_under(eye, UP, 3.0, 3.0) {
            assert!((under.distance - eye[2]).abs() < 0.05, "{under:?} from {eye:?}");
            found += 1;
        }
    }
    assert!(found * 3 > asked * 2, "{found} of {asked}");
    assert!(builder.map().up().is_none_or(|up| up[2] > 0.99));
}

#[test]
fn where_nothing_is_there_is_no_floor() {
    let empty = MapBuilder::new(MapConfig::default()).unwrap().into_map();
    assert_eq!(empty.floor_under([0.0, 0.0, 1.3], UP, f64::INFINITY, f64::INFINITY), None);
    let map = mapped(&floor(), &Pose::identity());
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(map.floor_under([0.0, odd, 1.3], UP, 3.0, 3.0), None);
        assert_eq!(map.floor_under([0.0, 0.0, 1.3], [0.0, odd, 1.0], 3.0, 3.0), None);
    }
    assert_eq!(map.floor_under([0.0, 0.0, 1.3], [0.0; 3], 3.0, 3.0), None);
    assert_eq!(map.floor_under([0.0, 0.0, 1.3], UP, f64::NAN, 3.0), None);
    assert_eq!(map.floor_under([0.0, 0.0, 1.3], UP, 3.0, f64::NAN), None);
    assert_eq!(map.floor_under([0.0, 0.0, 1e12], UP, 3.0, 3.0), None);
    let all = map.floor_under([0.0, 0.0, 1.3], UP, f64::INFINITY, f64::INFINITY);
    assert_eq!(all, map.floor_under([0.0, 0.0, 1.3], UP, 3.0, 3.0));
}

#[test]
fn what_stands_on_a_plane_touches_it() {
    let mut config = SequenceConfig::default();
    (config.frames, config.frame_rate) = (50, 5.0);
    config.camera = Some(fine_camera());
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    for frame in Sequence::new(&config).unwrap().frames() {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
    let map = builder.into_map();
    let mut standing = 0;
    for plane in map.planes().iter() {
        for object in map.objects_on(plane.id()) {
            assert_eq!(object.support().and_then(|support| support.id), Some(plane.id()));
            let own = object.oriented_box();
            let heights = own.corners().map(|corner| plane.plane().signed_distance(corner));
            let lowest = heights.into_iter().fold(f64::INFINITY, f64::min);
            assert!(lowest.abs() < 0.05, "a {} {lowest} m over its plane", object.label());
            assert_eq!(
                map.objects().near(own.center(), 0.0).first().map(|near| near.id()),
                Some(object.id())
            );
            standing += 1;
        }
    }
    assert!(standing >= 4, "{standing}");
}

//! Planes of a room by other cameras and sensors than a Kinect at 640x480.

use crate::common::{World, dot, look_at, minus, room, room_views};
use dymlm_core::{DepthImage, DepthNoise, Frame, PinholeCamera, Pose, SensorModel, SplitMix64};
use dymlm_planes::{MapPlane, PlaneConfig, PlaneMap, PlaneMapper};

fn camera(width: usize, height: usize, focal_length: f64) -> PinholeCamera {
    let center = [width, height].map(|side| 0.5 * (side as f64 - 1.0));
    PinholeCamera::new(width, height, focal_length, focal_length, center[0], center[1]).unwrap()
}

/// What a sensor sees, with half of its model's noise, which is that of a good one.
fn seen_by(sensor: SensorModel, world: &World, camera: PinholeCamera, view: &Pose, seed: u64) -> Frame {
    if sensor.noise == DepthNoise::kinect() {
        return world.frame(camera, view, seed);
    }
    let mut random = SplitMix64::new(seed);
    let mut noisy = |z: f32| {
        // A sum of twelve uniform numbers has a deviation of 1.
        let normal = (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0;
        if z > 0.0 { z + 0.5 * sensor.sigma(z) * normal as f32 } else { 0.0 }
    };
    let exact = world.depth(&camera, view);
    let depth = exact.data().iter().map(|&z| noisy(z)).collect();
    let depth = DepthImage::new(camera.width(), camera.height(), depth).unwrap();
    Frame::new(seed as f64, camera, depth, None).unwrap()
}

fn map_of_room(sensor: SensorModel, camera: PinholeCamera, views: &[Pose]) -> PlaneMap {
    let mut mapper = PlaneMapper::new(PlaneConfig::default(), sensor).unwrap();
    for (view, k) in views.iter().zip(0..) {
        mapper.insert(&seen_by(sensor, &room(), camera, view, k), None, &[], view).unwrap();
    }
    mapper.into_map()
}

/// Each of the room's four planes is one of the map's, within an angle (degrees) and an offset (metres), and
/// there is no other.
fn check_room(map: &PlaneMap, max_angle: f64, max_offset: f64, what: &str) {
    let expected: [([f64; 3], [f64; 3]); 4] = [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
        ([0.0, -1.0, 0.0], [0.0, 1.6, 0.0]),
        ([-1.0, 0.0, 0.0], [1.4, 0.0, 0.0]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.75]),
    ];
    let planes: Vec<_> = map.iter().map(|plane| (plane.plane(), plane.centroid())).collect();
    for (normal, point) in expected {
        let is_it = |plane: &&MapPlane| {
            let angle = dot(plane.plane().normal(), normal).min(1.0).acos().to_degrees();
            angle < max_angle && dot(normal, minus(plane.centroid(), point)).abs() < max_offset
        };
        assert_eq!(map.iter().filter(is_it).count(), 1, "{what}: {normal:?} {point:?} in {planes:?}");
    }
    assert_eq!(map.len(), 4, "{what}: {planes:?}");
}

#[test]
fn a_room_is_four_planes_at_any_image_size() {
    for (width, height, focal_length) in [(320, 240, 262.5), (640, 480, 525.0), (1280, 720, 920.0)] {
        let map = map_of_room(SensorModel::kinect(), camera(width, height, focal_length), &room_views());
        check_room(&map, 0.4, 0.006, &format!("{width}x{height}"));
    }
}

#[test]
fn a_room_is_four_planes_to_a_wide_angle() {
    // 110 degrees from side to side.
    let map = map_of_room(SensorModel::kinect(), camera(640, 480, 224.0), &room_views());
    check_room(&map, 0.6, 0.01, "110 degrees");
}

#[test]
fn a_room_is_four_planes_to_other_sensors() {
    let stereo = camera(848, 480, 425.0);
    check_room(&map_of_room(SensorModel::realsense_d4xx(), stereo, &room_views()), 0.8, 0.015, "stereo");
    let time_of_flight = camera(640, 576, 504.0);
    check_room(
        &map_of_room(SensorModel::time_of_flight(), time_of_flight, &room_views()),
        0.6,
        0.01,
        "time of flight",
    );
}

#[test]
fn a_camera_rolled_by_a_quarter_sees_the_same_room() {
    let half = 0.5_f64.sqrt();
    let roll = Pose::new([0.0; 3], [0.0, 0.0, half, half]).unwrap();
    let views: Vec<Pose> = room_views().into_iter().map(|view| view * roll).collect();
    let map = map_of_room(SensorModel::kinect(), camera(480, 640, 525.0), &views);
    check_room(&map, 0.4, 0.006, "rolled");
}

#[test]
fn far_walls_are_planes_as_far_as_the_sensor_is_used() {
    // 0.6 m before the end of the range, where a stereo pair errs by some centimetres, and samples are
    // sparser than voxels.
    for sensor in [SensorModel::kinect(), SensorModel::realsense_d4xx(), SensorModel::time_of_flight()] {
        let distance = f64::from(sensor.max_depth) - 0.6;
        let wall = World::of(&[crate::common::upright([0.0, distance, 0.0], 1.2, 0.9)]);
        let views: Vec<Pose> =
            (0..4).map(|k| look_at([0.02 * f64::from(k), 0.0, 0.0], [0.0, 3.0, 0.0])).collect();
        let mut mapper = PlaneMapper::new(PlaneConfig::default(), sensor).unwrap();
        for (view, k) in views.iter().zip(0..) {
            mapper
                .insert(&seen_by(sensor, &wall, camera(640, 480, 525.0), view, k), None, &[], view)
                .unwrap();
        }
        let areas: Vec<f64> = mapper.map().iter().map(MapPlane::area).collect();
        assert!(areas.len() == 1 && areas[0] > 3.0, "{sensor:?}: {areas:?}");
    }
}

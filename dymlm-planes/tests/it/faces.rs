//! What must stay apart stays apart, and what is no plane yields none.

use crate::common::{Cuboid, Cylinder, World, camera, dot, level, look_at, room, room_views, upright};
use dymlm_core::{DepthImage, DepthNoise, Frame, PinholeCamera, Pose, SensorModel, SplitMix64};
use dymlm_planes::{DetectedPlane, MapPlane, PlaneDetector, PlaneDetectorConfig, PlaneMap};
use dymlm_test_support::normal;

fn map_of(world: &World, views: &[Pose]) -> PlaneMap {
    map_with(&camera(), world, views)
}

fn map_with(camera: &PinholeCamera, world: &World, views: &[Pose]) -> PlaneMap {
    let mut mapper = crate::common::mapper();
    for (k, view) in views.iter().enumerate() {
        mapper.insert(&world.frame(*camera, view, k as u64), None, &[], view).unwrap();
    }
    mapper.into_map()
}

/// Planes near a given one: within 3 degrees and 2 cm at their centroid.
fn planes_like(map: &PlaneMap, normal: [f64; 3], point: [f64; 3]) -> Vec<&MapPlane> {
    map.iter()
        .filter(|plane| {
            dot(plane.plane().normal(), normal) > 0.9986
                && dot(normal, crate::common::minus(plane.centroid(), point)).abs() < 0.02
        })
        .collect()
}

fn from_the_front(heights: &[f64]) -> Vec<Pose> {
    heights.iter().map(|&z| look_at([0.0, -1.6, z], [0.0, 0.6, 0.5])).collect()
}

#[test]
fn a_room_has_four_planes() {
    let map = map_of(&room(), &room_views());
    let expected: [([f64; 3], [f64; 3]); 4] = [
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
        ([0.0, -1.0, 0.0], [0.0, 1.6, 0.0]),
        ([-1.0, 0.0, 0.0], [1.4, 0.0, 0.0]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.75]),
    ];
    for (normal, point) in expected {
        let found = planes_like(&map, normal, point);
        assert_eq!(found.len(), 1, "{normal:?} {point:?}");
        let angle = dot(found[0].plane().normal(), normal).min(1.0).acos().to_degrees();
        let offset = found[0].plane().signed_distance(crate::common::minus(
            found[0].centroid(),
            normal.map(|n| n * dot(normal, crate::common::minus(found[0].centroid(), point))),
        ));
        assert!(angle < 0.3 && offset.abs() < 0.005, "{angle} degrees, {offset} m");
        assert_eq!(found[0].observations(), 6);
    }
    assert_eq!(map.len(), 4, "{:#?}", map.iter().map(MapPlane::plane).collect::<Vec<_>>());
    let table = planes_like(&map, [0.0, 0.0, 1.0], [0.0, 0.0, 0.75])[0];
    assert!((table.area() - 0.7).abs() < 0.07, "{}", table.area());
    let boundary = table.boundary();
    assert!((boundary[0].area() - 0.7).abs() < 0.07 && boundary[0].holes.is_empty());
}

#[test]
fn two_desks_of_the_same_height_stay_two_planes() {
    let floor = level([0.0, 0.5, 0.0], 3.0, 3.0);
    let desks = |gap: f64| {
        let (half, at) = (0.35, 0.35 + 0.5 * gap);
        World::of(&[floor, level([-at, 0.5, 0.75], half, 0.35), level([at, 0.5, 0.75], half, 0.35)])
    };
    let views = from_the_front(&[1.4, 1.45, 1.5, 1.55]);
    let apart = map_of(&desks(0.3), &views);
    assert_eq!(planes_like(&apart, [0.0, 0.0, 1.0], [0.0, 0.0, 0.75]).len(), 2);
    // Pushed together they are one.
    let together = map_of(&desks(0.0), &views);
    assert_eq!(planes_like(&together, [0.0, 0.0, 1.0], [0.0, 0.0, 0.75]).len(), 1);
}

/// Two screens side by side, 15 cm apart and 20 cm before a wall, seen at 80 degrees: in the image the gap is
/// two pixels wide.
#[test]
fn twin_screens_seen_aslant_stay_two_planes() {
    let screens = [-0.345, 0.345].map(|x| upright([x, 1.4, 0.9], 0.27, 0.165));
    let wall = upright([0.0, 1.6, 1.0], 3.0, 1.0);
    let world = World::of(&[screens[0], screens[1], wall]);
    let views: Vec<Pose> =
        (0..8).map(|k| look_at([-2.5 + 0.02 * f64::from(k), 0.5, 1.1], [0.0, 1.4, 0.9])).collect();
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let map = map_with(&fine, &world, &views);
    let found = planes_like(&map, [0.0, -1.0, 0.0], [0.0, 1.4, 0.9]);
    assert_eq!(found.len(), 2, "{:?}", found.iter().map(|plane| plane.centroid()).collect::<Vec<_>>());
    assert!(found[0].centroid()[0] * found[1].centroid()[0] < 0.0);
}

#[test]
fn both_faces_of_a_thin_partition_stay_two() {
    let faces = [upright([0.0, 0.49, 0.8], 0.8, 0.8), upright([0.0, 0.51, 0.8], 0.8, 0.8)];
    let world = World::of(&faces);
    let mut views = Vec::new();
    for k in 0..4 {
        let x = 0.1 * f64::from(k);
        views.push(look_at([x, -1.2, 1.2], [0.0, 0.5, 0.8]));
        views.push(look_at([x, 2.2, 1.2], [0.0, 0.5, 0.8]));
    }
    let map = map_of(&world, &views);
    assert_eq!(map.len(), 2);
    // Each side faces those who saw it, and is where it is, as large as it is.
    for (side, place) in [(-1.0, 0.49), (1.0, 0.51)] {
        let found = planes_like(&map, [0.0, side, 0.0], [0.0, place, 0.8]);
        assert_eq!(found.len(), 1, "{side}");
        let (plane, area) = (found[0], found[0].area());
        assert!((plane.centroid()[1] - place).abs() < 0.004, "{:?}", plane.centroid());
        assert!((area / (1.6 * 1.6) - 1.0).abs() < 0.1, "{area}");
        assert_eq!(plane.observations(), 4);
    }
}

#[test]
fn a_staircase_stays_apart() {
    // Five steps of 17 cm height and 28 cm depth, 1.2 m wide.
    let mut steps = Vec::new();
    for k in 0..5 {
        let (y, z) = (0.28 * f64::from(k), 0.17 * f64::from(k));
        steps.push(upright([0.0, y, z + 0.085], 0.6, 0.085));
        steps.push(level([0.0, y + 0.14, z + 0.17], 0.6, 0.14));
    }
    let views: Vec<Pose> =
        (0..4).map(|k| look_at([0.1 * f64::from(k), -1.0, 1.5], [0.0, 0.6, 0.4])).collect();
    let map = map_of(&World::of(&steps), &views);
    for k in 0..5 {
        let (y, z) = (0.28 * f64::from(k), 0.17 * f64::from(k));
        assert_eq!(planes_like(&map, [0.0, 0.0, 1.0], [0.0, 0.0, z + 0.17]).len(), 1, "tread {k}");
        assert_eq!(planes_like(&map, [0.0, -1.0, 0.0], [0.0, y, 0.0]).len(), 1, "riser {k}");
    }
    assert_eq!(map.len(), 10);
}

#[test]
fn a_cylinder_yields_no_plane() {
    for radius in [0.1, 0.15, 0.2, 0.3] {
        let mut world = World::default();
        world.cylinders.push(Cylinder { foot: [0.0, 0.6, 0.0], radius, height: 1.6 });
        let views: Vec<Pose> =
            (0..4).map(|k| look_at([0.1 * f64::from(k), -0.9, 1.0], [0.0, 0.6, 0.8])).collect();
        let map = map_of(&world, &views);
        let planes: Vec<_> = map.iter().map(|plane| (plane.plane(), plane.area())).collect();
        assert!(planes.is_empty(), "radius {radius}: {planes:?}");
    }
}

/// The inner sides of a doorway, 12 cm deep and seen at a slant, are a block wide in the image.
#[test]
fn the_sides_of_a_doorway_are_planes() {
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut world = World::of(&[level([0.0, 0.0, 0.0], 5.0, 5.0)]);
    let mut add = |at: [f64; 3], lengths| {
        let world_from_cuboid = Pose::new(at, [0.0, 0.0, 0.0, 1.0]).unwrap();
        world.cuboids.push(Cuboid { world_from_cuboid, lengths });
    };
    add([-1.475, 0.06, 1.2], [2.0, 0.12, 2.4]);
    add([1.475, 0.06, 1.2], [2.0, 0.12, 2.4]);
    let views: Vec<Pose> =
        (0..12).map(|k| look_at([0.0, -2.2 + 0.07 * f64::from(k), 1.3], [0.0, 1.0, 1.1])).collect();
    let map = map_with(&fine, &world, &views);
    for side in [-1.0, 1.0] {
        let found = planes_like(&map, [-side, 0.0, 0.0], [0.475 * side, 0.06, 1.0]);
        assert_eq!(found.len(), 1, "{side}: {:?}", map.iter().map(MapPlane::plane).collect::<Vec<_>>());
    }
}

/// Where the noise hides a step between two surfaces, a plane through both is as flat as either.
#[test]
fn a_step_within_the_noise_yields_no_plane() {
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
    let mut steps = Vec::new();
    for k in 0..40_u64 {
        let height = 0.02 + 0.002 * (k % 20) as f64;
        let world = World::of(&[
            upright([0.0, 3.2, 1.0], 2.0, 1.5),
            upright([-1.0, 3.2 - height, 1.0], 0.9 + 0.007 * k as f64, 1.5),
        ]);
        let view = look_at([0.2 * (k % 3) as f64, 0.0, 1.2], [0.0, 3.0, 1.0]);
        let planes = detector.detect(&world.frame(fine, &view, k), None, &[]).unwrap();
        let normals = planes.iter().map(|plane| plane.plane.transformed(&view).normal());
        steps.extend(normals.filter(|normal| normal[1] > -0.99).map(|normal| (height, normal)));
    }
    assert!(steps.is_empty(), "{steps:?}");
}

/// Beside a strip of a pillar the surface goes on and bends away, which tells it from a board. A strip in one
/// frame is never confirmed; without this rule there are 19 in these 60 frames.
#[test]
fn a_pillar_that_one_walks_past_hardly_yields_a_strip() {
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut world = World::of(&[level([0.0, 0.0, 0.0], 5.0, 5.0)]);
    world.cylinders.push(Cylinder { foot: [0.0, 0.6, 0.0], radius: 0.47, height: 2.5 });
    let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
    let mut strips = Vec::new();
    for k in 0..60_u64 {
        let (step, aside) = (0.12 * (k % 30) as f64, if k < 30 { 0.9 } else { -1.3 });
        let eye = [aside, -3.6 + step, 1.4];
        let view = look_at(eye, [0.4 * aside, eye[1] + 2.5, 1.1]);
        let planes = detector.detect(&world.frame(fine, &view, k), None, &[]).unwrap();
        let upright = planes.iter().map(|plane| plane.plane.transformed(&view).normal());
        strips.extend(upright.filter(|normal| normal[2] < 0.9).map(|normal| (k, normal)));
    }
    assert!(strips.len() <= 1, "{strips:?}");
}

/// From near the pillar to where it is a few blocks wide.
#[test]
fn a_pillar_yields_no_plane_from_any_distance() {
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    for radius in [0.3, 0.4, 0.5] {
        let mut world = World::of(&[level([0.0, 0.0, 0.0], 4.0, 4.0)]);
        world.cylinders.push(Cylinder { foot: [0.0, 0.6, 0.0], radius, height: 2.5 });
        let views: Vec<Pose> = (0..24)
            .map(|k| {
                let (step, from) = (f64::from(k % 4), -0.8 - 0.4 * f64::from(k / 4));
                look_at([0.1 * step, from - radius, 1.4], [0.0, 0.6, 1.1])
            })
            .collect();
        let map = map_with(&fine, &world, &views);
        let planes: Vec<_> = map.iter().filter(|plane| plane.plane().normal()[2] < 0.9).collect();
        let planes: Vec<_> = planes.iter().map(|plane| (plane.plane(), plane.area())).collect();
        assert!(planes.is_empty(), "radius {radius}: {planes:?}");
    }
}

#[test]
fn a_wall_behind_a_pillar_is_one_plane() {
    let wall = upright([0.0, 1.4, 1.0], 1.3, 0.7);
    let pillar = upright([0.0, 0.9, 1.0], 0.15, 1.0);
    // From these places the pillar hides a strip of the wall from top to bottom.
    let views: Vec<Pose> =
        (0..4).map(|k| look_at([0.01 * f64::from(k), -0.8, 1.0], [0.0, 1.4, 1.0])).collect();
    let whole = map_of(&World::of(&[wall, pillar]), &views);
    assert_eq!(planes_like(&whole, [0.0, -1.0, 0.0], [0.0, 1.4, 0.0]).len(), 1);
    assert_eq!(whole.len(), 2);
    // Where the gap is seen through, there are two.
    let halves = [upright([-0.8, 1.4, 1.0], 0.5, 0.7), upright([0.8, 1.4, 1.0], 0.5, 0.7)];
    let parted = map_of(&World::of(&[halves[0], halves[1], upright([0.0, 2.2, 1.0], 2.0, 1.0)]), &views);
    assert_eq!(planes_like(&parted, [0.0, -1.0, 0.0], [0.0, 1.4, 0.0]).len(), 2);
}

/// A frame with all of a Kinect's noise (Nguyen 2012): along the ray, and of the image position.
fn noisy_frame(exact: &DepthImage, camera: PinholeCamera, seed: u64) -> Frame {
    let (width, height) = (camera.width(), camera.height());
    let mut random = SplitMix64::new(seed);
    let mut reading = |pixel: usize| {
        let mut beside = |at: usize, end: usize| {
            (at as f64 + 0.8 * normal(&mut random)).round().clamp(0.0, (end - 1) as f64) as usize
        };
        let z = exact.at(beside(pixel % width, width), beside(pixel / width, height));
        z + DepthNoise::kinect().sigma(z) * normal(&mut random) as f32
    };
    let depth = DepthImage::new(width, height, (0..width * height).map(&mut reading).collect()).unwrap();
    Frame::new(seed as f64, camera, depth, None).unwrap()
}

/// On a table seen at a grazing angle noise hardly moves readings off the table, but by centimetres off the wall
/// behind it: so the wall's readings just above the table are far from the table, though it is the nearer plane.
#[test]
fn readings_of_a_wall_just_above_a_table_are_the_walls() {
    let fine = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
    let world = World::of(&[
        level([0.0, 0.0, 0.0], 5.0, 5.0),
        upright([0.0, 3.2, 1.2], 3.0, 1.2),
        level([0.0, 2.8, 0.75], 0.8, 0.4),
    ]);
    let (mut of_wall, mut taken) = (0, 0);
    for k in 0..10_u64 {
        let view = look_at([0.1 * (k % 5) as f64, 0.05 * k as f64, 1.4], [0.0, 2.8, 0.9]);
        let exact = world.depth(&fine, &view);
        let planes = detector.detect(&noisy_frame(&exact, fine, k), None, &[]).unwrap();
        let is_level = |plane: &&DetectedPlane| {
            let plane = plane.plane.transformed(&view);
            plane.normal()[2] > 0.99 && plane.d() < -0.5
        };
        let table = planes.iter().find(is_level).unwrap().label;
        for (pixel, label) in detector.labels().iter().enumerate() {
            let (u, v) = (pixel % 640, pixel / 640);
            let place = fine.back_project([u as f64, v as f64], f64::from(exact.at(u, v)));
            let [x, y, z] = view.transform_point(place);
            if y > 3.19 && x.abs() < 0.7 && (0.75..0.80).contains(&z) {
                of_wall += 1;
                taken += u32::from(*label == table);
            }
        }
    }
    // 24 %; by distances in metres it takes 28 %.
    assert!(100 * taken < 26 * of_wall, "{taken} of {of_wall}");
}

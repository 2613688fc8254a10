//! Scans: the same as images of the same readings, free space against a look at all rays, exact removal,
//! refused input; and OctoMap's scan.

use dymlm_cloud::{CloudMap, CloudMapConfig, CloudVoxel, Error, Selection, Verdict};
use dymlm_core::vector3::{difference, dot, norm, unit};
use dymlm_core::{DepthNoise, Frame, PinholeCamera, Point, Pose, SensorModel, SplitMix64};
use dymlm_geometry::OrientedBox;
use dymlm_test_support::{Cuboid, Rectangle, World, recording};

fn lidar() -> SensorModel {
    let noise = DepthNoise::constant(0.01);
    SensorModel { noise, min_depth: 0.3, max_depth: 20.0, ..SensorModel::kinect() }
}

fn empty() -> CloudMap {
    CloudMap::new(CloudMapConfig::default(), lidar()).unwrap()
}

fn voxels(map: &CloudMap) -> Vec<CloudVoxel> {
    map.voxels(Selection::All).collect()
}

fn camera() -> PinholeCamera {
    PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap()
}

/// Floor, wall and, for one frame of six, somebody.
fn room(step: u32) -> World {
    let rectangles =
        vec![Rectangle::level([0.0; 3], 3.0, 3.0), Rectangle::upright([0.0, 3.0, 1.0], 3.0, 1.0)];
    let place = Pose::new([-0.3, 1.6, 0.9], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let visitor = Cuboid { world_from_cuboid: place, lengths: [0.4, 0.3, 1.0] };
    World { rectangles, cuboids: if step == 2 { vec![visitor] } else { vec![] }, ..World::default() }
}

fn view(step: u32) -> Pose {
    let rows = [[1.0, 0.0, 0.0], [0.0, -0.3, 0.954], [0.0, -0.954, -0.3]];
    Pose::from_rotation_matrix(rows, [0.1 * f64::from(step) - 0.3, 0.0, 1.2]).unwrap()
}

/// The readings of an image as points of the camera.
fn points_of(frame: &Frame) -> Vec<Point> {
    let width = frame.camera().width();
    let pixels = frame.depth().data().iter().enumerate();
    let place = |(i, &z): (usize, &f32)| {
        frame.camera().back_project([(i % width) as f64, (i / width) as f64], z.into()).map(|c| c as f32)
    };
    pixels.map(place).collect()
}

fn scans() -> Vec<(f64, Vec<Point>, Pose)> {
    let scan = |step: u32| {
        let frame = room(step).frame(camera(), &view(step), u64::from(step));
        (f64::from(step), points_of(&frame), view(step))
    };
    (0..6).map(scan).collect()
}

#[test]
fn a_scan_is_worth_what_an_image_of_its_readings_is() {
    let (mut scanned, mut seen) = (empty(), empty());
    for (step, (time, points, pose)) in (0..).zip(scans()) {
        scanned.insert_scan(time, &points, &pose).unwrap();
        let frame = room(step).frame(camera(), &view(step), u64::from(step));
        seen.insert(&frame, None, &pose).unwrap();
    }
    let visitor = OrientedBox::between([-0.5, 1.44, 0.41], [-0.1, 1.76, 1.41]).unwrap();
    let count = |map: &CloudMap, selection| {
        let is_in = |voxel: &CloudVoxel| visitor.contains(voxel.position.map(f64::from));
        let (inside, outside): (Vec<_>, Vec<_>) = map.voxels(selection).partition(is_in);
        [inside.len(), outside.len()]
    };
    let [all_scanned, all_seen] = [&scanned, &seen].map(|map| count(map, Selection::All));
    assert!(all_scanned[0] > 100 && all_scanned[1].abs_diff(all_seen[1]) * 50 < all_seen[1]);
    let [scanned, seen] = [&scanned, &seen].map(|map| count(map, Selection::Static));
    eprintln!("{all_scanned:?} {all_seen:?}, static {scanned:?} {seen:?}");
    assert_eq!([scanned[0], seen[0]], [0, 0]);
    assert!(scanned[1] * 100 > 97 * seen[1], "{scanned:?} {seen:?}");
}

#[test]
fn free_is_what_a_look_at_all_rays_finds() {
    let (mut map, mut random) = (empty(), SplitMix64::new(3));
    let eye = Pose::new([0.11, -0.07, 0.43], [0.5, 0.5, -0.5, 0.5]).unwrap();
    let points: Vec<Point> = (0..60)
        .map(|_| {
            let direction = unit([(); 3].map(|()| random.fraction() - 0.5)).unwrap();
            let range = 0.2 + 2.0 * random.fraction();
            direction.map(|c| (range * c) as f32)
        })
        .collect();
    map.insert_scan(1.0, &points, &eye).unwrap();
    let (side, sensor) = (map.verdicts().cell_size(), lidar());
    // Distances of the points, and where they are, in cells.
    let place = |point: &Point| eye.transform_point(point.map(f64::from)).map(|c| c / side);
    let ends: Vec<(f64, [f64; 3])> =
        points.iter().map(|point| (norm(point.map(f64::from)), place(point))).collect();
    let (mut free, mut compared) = (0, 0);
    for index in 0..100_i32.pow(3) {
        let cell = [index % 100, index / 100 % 100, index / 10_000].map(|c| c - 50);
        let center = cell.map(|c| (f64::from(c) + 0.5) * side);
        let offset = difference(center, eye.translation());
        let rays = ends.iter().map(|&(range, end)| {
            let ray = difference(end.map(|c| (c.floor() + 0.5) * side), eye.translation());
            (range, norm(ray), ray)
        });
        let mut is_near_a_limit = false;
        let is_passed = rays.clone().any(|(read, range, ray)| {
            let away = dot(offset, ray) / range;
            let beside = norm(difference(offset, ray.map(|c| c * away / range)));
            let end = range - sensor.tolerance(range as f32, 0.75_f64.sqrt() * side);
            let is_near = |a: f64, b: f64| (a - b).abs() < 1e-4;
            is_near_a_limit |= is_near(beside, 0.5 * side) || is_near(away, end) || is_near(away, 0.3);
            read >= 0.3 && beside <= 0.5 * side && away >= 0.3 && away < end
        });
        let is_read = ends.iter().any(|(range, end)| *range >= 0.3 && end.map(|c| c.floor() as i32) == cell);
        if is_near_a_limit || is_read {
            continue;
        }
        let periods = map.history(center).periods;
        let looks: u32 = periods.iter().map(|period| period.evidence.looked_through).sum();
        assert_eq!(looks, u32::from(is_passed), "{center:?}");
        (free, compared) = (free + looks, compared + 1);
    }
    assert!(free > 700 && compared > 900_000, "{free} of {compared}");
}

#[test]
fn scans_come_in_any_order_and_can_be_taken_out() {
    let scans = scans();
    let insert = |order: &[usize]| {
        let mut map = empty();
        for &index in order {
            let (time, points, pose) = &scans[index];
            map.insert_scan(*time, points, pose).unwrap();
        }
        map
    };
    let (forth, back) = (insert(&[0, 1, 2, 3]), insert(&[3, 1, 0, 2]));
    assert_eq!(voxels(&forth), voxels(&back));
    let mut without = insert(&[0, 4, 1, 5, 2, 3]);
    for index in [4, 5] {
        let (time, points, pose) = &scans[index];
        without.remove_scan(*time, points, pose).unwrap();
    }
    assert_eq!(voxels(&without), voxels(&forth));
    // What was never put in stays out.
    let (time, points, pose) = &scans[5];
    assert!(matches!(without.remove_scan(*time, points, pose), Err(Error::NotInserted { .. })));
    assert_eq!(voxels(&without), voxels(&forth));
    // A scan and frames in one map, and two maps in one.
    let frame = room(5).frame(camera(), &view(5), 5);
    let (mut both, mut other) = (insert(&[0, 1]), insert(&[2]));
    both.insert(&frame, None, &view(5)).unwrap();
    other.insert(&frame, None, &view(5)).unwrap();
    both.merge(&other).unwrap();
    for _ in 0..2 {
        both.remove(&frame, None, &view(5)).unwrap();
    }
    assert_eq!(voxels(&both), voxels(&insert(&[0, 1, 2])));
}

#[test]
fn what_is_no_reading_is_passed_over_and_what_is_no_scan_refused() {
    let mut map = empty();
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|odd| [1.0, odd, 0.0]);
    let report = map.insert_scan(0.0, &odd, &Pose::identity()).unwrap();
    assert_eq!((report.readings, map.held_voxels()), (0, 0));
    // Too near, too far, and nowhere.
    let out_of_range = [[0.1, 0.0, 0.0], [30.0, 0.0, 0.0], [0.0; 3], [1e30; 3]];
    let report = map.insert_scan(0.0, &out_of_range, &Pose::identity()).unwrap();
    assert_eq!((report.readings, map.held_voxels()), (0, 0));
    assert_eq!(map.insert_scan(0.0, &[], &Pose::identity()).unwrap().readings, 0);
    // A lidar's packets have zeros for rays that met nothing, whatever the range.
    let mut near =
        CloudMap::new(CloudMapConfig::default(), SensorModel { min_depth: 0.0, ..lidar() }).unwrap();
    near.insert_scan(0.0, &[], &Pose::identity()).unwrap();
    let before = near.memory_bytes();
    let aside = Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert_eq!(near.insert_scan(0.0, &[[0.0; 3]; 9], &aside).unwrap().readings, 0);
    assert!(near.memory_bytes() < before + 1000, "no evidence of anything");

    let points = [[2.0, 0.0, 0.0]];
    map.insert_scan(1.0, &points, &Pose::identity()).unwrap();
    let before = voxels(&map);
    for time in [f64::NAN, f64::INFINITY] {
        assert!(matches!(map.insert_scan(time, &points, &Pose::identity()), Err(Error::Core(_))));
    }
    let far = Pose::new([1e6, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert!(matches!(map.insert_scan(2.0, &points, &far), Err(Error::OutOfReach { .. })));
    assert_eq!(voxels(&map), before);
}

/// One laser scan of a corridor, thrice: what stands there is read where it is, and nothing is a ghost of
/// itself.
#[test]
fn the_scan_of_octomap_is_mapped() {
    let Some(path) = recording("octomap/scan.dat") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let point = |line: &str| -> Option<Point> {
        let mut numbers = line.split_whitespace().map(|word| word.parse().ok());
        Some([numbers.next()??, numbers.next()??, numbers.next()??])
    };
    let points: Vec<Point> = text.lines().filter_map(point).collect();
    assert!(points.len() > 88_000);
    let mut config = CloudMapConfig::default();
    config.voxel_size = 0.02;
    let mut map = CloudMap::new(config, lidar()).unwrap();
    for second in 0..3 {
        let start = std::time::Instant::now();
        let report = map.insert_scan(f64::from(second), &points, &Pose::identity()).unwrap();
        eprintln!("{report:?} in {:?}", start.elapsed());
    }
    let cloud = map.point_cloud(Selection::Static);
    let in_range: Vec<&Point> =
        points.iter().filter(|point| (0.3..=20.0).contains(&norm(point.map(f64::from)))).collect();
    eprintln!("{} in range, {} voxels, {} static", in_range.len(), map.held_voxels(), cloud.len());
    // Their points are fewer: where the noise is larger than a voxel, they are fused.
    assert!(map.voxels(Selection::Static).count() * 100 >= 95 * map.held_voxels());
    assert!(cloud.len() * 100 >= 60 * map.held_voxels());
    let found = map.static_points();
    let is_mapped = |point: &&&Point| found.nearest(point.map(f64::from), 0.05).is_some();
    assert!(in_range.iter().filter(is_mapped).count() * 100 >= 98 * in_range.len());
}

/// What a lidar of 16 rings reads 0.6 m above the floor of a hall, with walls at 5 m on both sides, and
/// perhaps somebody, a box by its lowest and highest corner.
fn ring_scan(x: f64, visitor: Option<[[f64; 3]; 2]>, random: &mut SplitMix64) -> Vec<Point> {
    let ray = |index: u32| {
        let [elevation, azimuth] = [2 * (index % 16), 4 * (index / 16)].map(f64::from);
        let [elevation, azimuth] = [elevation - 15.0, azimuth].map(f64::to_radians);
        [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()]
    };
    let eye = [x, 0.0, 0.6];
    let read = |direction: [f64; 3]| {
        let floor = if direction[2] < 0.0 { -eye[2] / direction[2] } else { f64::INFINITY };
        let mut range = floor.min(5.0 / direction[1].abs());
        if let Some(corners) = visitor {
            let ways =
                [0, 1, 2].map(|axis| corners.map(|corner| (corner[axis] - eye[axis]) / direction[axis]));
            let enters = ways.iter().fold(0.0, |enters, [a, b]| f64::max(enters, a.min(*b)));
            let leaves = ways.iter().fold(f64::INFINITY, |leaves, [a, b]| f64::min(leaves, a.max(*b)));
            range = if enters <= leaves { range.min(enters) } else { range };
        }
        let noisy = range + 0.01 * dymlm_test_support::normal(random);
        direction.map(|c| (noisy * c) as f32)
    };
    (0..16 * 90).map(ray).map(read).filter(|point| norm(point.map(f64::from)) < 20.0).collect()
}

/// Regression: a flat ray passes over much of the floor before it ends on it, nearer to it than half a cell.
/// The rings of a lidar looked through the floor where they were about to read it, and behind a robot the
/// floor was gone.
#[test]
fn floor_and_walls_stay_behind_a_lidar_that_drives_and_who_was_there_does_not() {
    let (mut map, mut random) = (empty(), SplitMix64::new(11));
    let visitor = [[8.0, 1.8, 0.0], [8.4, 2.2, 1.0]];
    for step in 0..100_u32 {
        let x = 0.15 * f64::from(step);
        let pose = Pose::new([x, 0.0, 0.6], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let points = ring_scan(x, (step < 33).then_some(visitor), &mut random);
        map.insert_scan(0.1 * f64::from(step), &points, &pose).unwrap();
    }
    let verdicts = map.verdicts();
    let places: Vec<[f64; 3]> =
        map.voxels(Selection::All).map(|voxel| voxel.position.map(f64::from)).collect();
    let stays_within = |low: [f64; 3], high: [f64; 3]| {
        let is_within = |place: &&[f64; 3]| (0..3).all(|axis| (low[axis]..high[axis]).contains(&place[axis]));
        let asked: Vec<_> = places.iter().filter(is_within).map(|place| verdicts.at(*place)).collect();
        let stay = asked.iter().filter(|verdict| **verdict == Some(Verdict::Static)).count();
        assert!(asked.len() > 150, "{} voxels", asked.len());
        stay as f64 / asked.len() as f64
    };
    for y in 0..5 {
        let share = stays_within([9.0, f64::from(y), -0.05], [13.0, f64::from(y) + 0.9, 0.05]);
        assert!(share > 0.95, "{share} of the floor at {y} m");
    }
    assert!(stays_within([9.0, 4.9, 0.1], [13.0, 5.1, 2.0]) > 0.99);
    let share = stays_within([7.9, 1.7, 0.1], [8.5, 2.3, 1.1]);
    assert!(share < 0.05, "{share} of the visitor");
}

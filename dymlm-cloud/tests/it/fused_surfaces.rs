//! Voxels that are readings of one surface come out as one layer of points on it; all else stays.

use std::collections::BTreeSet;

use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::vector3::{difference, dot, norm};
use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Point, Pose, Rgb, SensorModel, SplitMix64};

const WIDTH: usize = 200;
const HEIGHT: usize = 150;
const FRAMES: u32 = 24;

/// Part of a Kinect's image: at 3.5 m its pixels are 7 mm apart.
fn camera() -> PinholeCamera {
    PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 99.5, 74.5).unwrap()
}

/// Depth and colour at a place of the image, by the ray's x / z and y / z.
type Scene<'a> = &'a dyn Fn(f64, f64) -> (f64, Rgb);

fn noisy(scene: Scene<'_>, time: u32, random: &mut SplitMix64) -> Frame {
    let sensor = SensorModel::kinect();
    let (mut depths, mut colors) = (Vec::new(), Vec::new());
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            let (z, color) = scene((u as f64 - 99.5) / 525.0, (v as f64 - 74.5) / 525.0);
            // Four uniform numbers have the variance 4 / 12.
            let noise = 3_f64.sqrt() * (0..4).map(|_| random.fraction() - 0.5).sum::<f64>();
            depths.push((z + noise * f64::from(sensor.sigma(z as f32))) as f32);
            colors.push(color);
        }
    }
    let depth = DepthImage::new(WIDTH, HEIGHT, depths).unwrap();
    let color = ColorImage::new(WIDTH, HEIGHT, colors).unwrap();
    Frame::new(f64::from(time), camera(), depth, Some(color)).unwrap()
}

fn map_of(scene: Scene<'_>, pose: &Pose, fuse_surfaces: bool) -> CloudMap {
    let mut config = CloudMapConfig::default();
    config.fuse_surfaces = fuse_surfaces;
    let (mut map, mut random) = (CloudMap::new(config, SensorModel::kinect()).unwrap(), SplitMix64::new(5));
    for time in 0..FRAMES {
        map.insert(&noisy(scene, time, &mut random), None, pose).unwrap();
    }
    map
}

/// The static points as the camera sees them.
fn seen(map: &CloudMap, pose: &Pose) -> Vec<[f64; 3]> {
    let (cloud, inverse) = (map.point_cloud(Selection::Static), pose.inverse());
    cloud.points().iter().map(|point| inverse.transform_point(point.map(f64::from))).collect()
}

fn quantile(mut values: Vec<f64>, percent: usize) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() * percent / 100]
}

fn poses() -> [Pose; 4] {
    let turned = [[0.0, 0.0, 0.0, 1.0], [0.3, -0.5, 0.1, 0.8], [0.5, 0.5, -0.5, 0.5], [0.9, 0.1, 0.4, 0.1]];
    turned.map(|rotation| {
        let length = rotation.iter().map(|c: &f64| c * c).sum::<f64>().sqrt();
        Pose::new([7.3, -2.1, 0.4], rotation.map(|c| c / length)).unwrap()
    })
}

/// A wall whose normal is (0.5, 0.1, -1), 3.4 m ahead.
fn slanted_wall(x: f64, y: f64) -> (f64, Rgb) {
    (3.4 / (1.0 - 0.5 * x - 0.1 * y), [90; 3])
}

fn above_slanted_wall(point: [f64; 3]) -> f64 {
    let normal = [-0.5, -0.1, 1.0];
    (dot(normal, point) - 3.4) / norm(normal)
}

#[test]
fn a_far_wall_is_one_layer_whatever_way_it_lies() {
    let sigma = f64::from(SensorModel::kinect().sigma(3.4));
    for pose in poses() {
        let heights = |points: &[[f64; 3]]| -> Vec<f64> {
            points.iter().map(|&point| above_slanted_wall(point).abs()).collect()
        };
        let read = seen(&map_of(&slanted_wall, &pose, false), &pose);
        let fused = seen(&map_of(&slanted_wall, &pose, true), &pose);
        let before = quantile(heights(&read), 95);
        assert!(before > 0.8 * sigma, "{before} of {sigma}");
        let (median, p95) = (quantile(heights(&fused), 50), quantile(heights(&fused), 95));
        assert!(median < 0.1 * sigma && p95 < 0.4 * sigma, "{median} {p95} of {sigma}");
        // One layer: about as many points as voxels that the wall passes through (1.4 to 1.8 a square of 1
        // cm), and a point in each of its squares of 2 cm that is not at its border.
        let squares = |points: &[[f64; 3]], side: f64| -> BTreeSet<[i64; 2]> {
            points.iter().map(|[x, y, _]| [x, y].map(|c| (c / side).floor() as i64)).collect()
        };
        assert!(fused.len() < 2 * squares(&fused, 0.01).len(), "{} points", fused.len());
        let [all, kept] = [squares(&read, 0.02), squares(&fused, 0.02)];
        let is_inside =
            |&[x, y]: &[i64; 2]| (-2..=2).all(|dx| (-2..=2).all(|dy| all.contains(&[x + dx, y + dy])));
        let holes = all.iter().filter(|&square| is_inside(square) && !kept.contains(square)).count();
        assert!(holes * 1000 <= all.len(), "{holes} holes in {} squares", all.len());
    }
}

#[test]
fn what_few_frames_have_read_of_a_wall_is_kept_beside_what_many_have_read() {
    let pose = Pose::identity();
    let sensor = SensorModel::kinect();
    let (mut map, mut random) =
        (CloudMap::new(CloudMapConfig::default(), sensor).unwrap(), SplitMix64::new(8));
    // Most frames read nothing of the right half.
    let left_half = |x: f64, y: f64| if x < 0.0 { slanted_wall(x, y) } else { (0.0, [90; 3]) };
    for time in 0..60 {
        let scene: Scene<'_> = if time < 4 { &slanted_wall } else { &left_half };
        map.insert(&noisy(scene, time, &mut random), None, &pose).unwrap();
    }
    // A voxel looks for heavier ones as far as 8 cm away.
    let squares: BTreeSet<[i64; 2]> =
        seen(&map, &pose).iter().map(|[x, y, _]| [x, y].map(|c| (c / 0.02).floor() as i64)).collect();
    let beside: Vec<[i64; 2]> = (0..4).flat_map(|x| (-20..20).map(move |y| [x, y])).collect();
    let kept = beside.iter().filter(|&square| squares.contains(square)).count();
    assert!(kept * 100 >= beside.len() * 95, "{kept} of {} squares", beside.len());
}

#[test]
fn both_sides_of_an_edge_are_kept() {
    // Two walls that meet at a right angle, 3.5 m ahead.
    let scene = |x: f64, _: f64| (3.5 / (1.0 + x.abs()), [90; 3]);
    let pose = Pose::identity();
    let fused = seen(&map_of(&scene, &pose, true), &pose);
    let sigma = f64::from(SensorModel::kinect().sigma(3.5));
    let off = |point: &[f64; 3]| (point[2] + point[0].abs() - 3.5).abs() / 2_f64.sqrt();
    let (edge, sides): (Vec<[f64; 3]>, Vec<_>) = fused.iter().partition(|point| point[0].abs() < 0.1);
    assert!(quantile(sides.iter().map(off).collect(), 95) < 0.6 * sigma);
    assert!(quantile(edge.iter().map(off).collect(), 95) < 1.2 * sigma);
    let reaches_edge = edge.iter().filter(|point| point[0].abs() < 0.02).count();
    assert!(reaches_edge > 40, "{reaches_edge} points at the edge");
}

#[test]
fn slats_before_a_wall_stay_where_they_are() {
    // 3 cm wide, 9 cm apart, 12 cm before the wall.
    let (wall, slats) = (3.2, 3.08);
    let is_slat = |x: f64| (slats * x).rem_euclid(0.12) < 0.03;
    let scene = |x: f64, _: f64| (if is_slat(x) { slats } else { wall }, [90; 3]);
    let pose = Pose::identity();
    let [read, fused] = [false, true].map(|fuses| seen(&map_of(&scene, &pose, fuses), &pose));
    // Squares of 2 cm in the image of the slats that have a point of theirs.
    let places = |points: &[[f64; 3]]| -> BTreeSet<[i64; 2]> {
        let near =
            points.iter().filter(|point| (point[2] - slats).abs() < 0.04 && is_slat(point[0] / point[2]));
        near.map(|point| [point[0], point[1]].map(|c| (c / 0.02).floor() as i64)).collect()
    };
    let (before, after) = (places(&read), places(&fused));
    assert!(before.len() > 500);
    assert!(after.len() * 100 >= 97 * before.len(), "{} of {}", after.len(), before.len());
}

#[test]
fn what_is_near_stays_as_it_was_read() {
    let scene = |x: f64, y: f64| (1.0 + 0.3 * x + 0.05 * (40.0 * y).sin(), [90; 3]);
    let [read, fused] = [false, true].map(|fuses| map_of(&scene, &Pose::identity(), fuses));
    assert_eq!(read.point_cloud(Selection::Static), fused.point_cloud(Selection::Static));
}

#[test]
fn colours_stay_sharp() {
    // A chequered wall: squares of 10 cm.
    let z = 3.3;
    let is_white = |x: f64, y: f64| ((z * x / 0.1).floor() + (z * y / 0.1).floor()) as i64 % 2 == 0;
    let scene = |x: f64, y: f64| (z, if is_white(x, y) { [255; 3] } else { [0; 3] });
    let gray = |fuses| {
        let map = map_of(&scene, &Pose::identity(), fuses);
        let cloud = map.point_cloud(Selection::Static);
        let colors = cloud.colors().unwrap();
        let right = cloud.points().iter().zip(colors).filter(|(point, color)| {
            let [x, y, z] = point.map(f64::from);
            color.iter().all(|&c| (c > 127) == is_white(x / z, y / z))
        });
        right.count() as f64 / cloud.len() as f64
    };
    let (read, fused) = (gray(false), gray(true));
    assert!(fused > 0.9 && fused >= read - 0.02, "{fused}, as read {read}");
}

#[test]
fn each_fused_point_is_found_where_it_lies() {
    let pose = poses()[1];
    let map = map_of(&slanted_wall, &pose, true);
    let cloud = map.point_cloud(Selection::Static);
    let points = map.static_points();
    let distance = |a: Point, b: Point| norm(difference(a.map(f64::from), b.map(f64::from)));
    for &point in cloud.points().iter().step_by(37) {
        let found = points.nearest(point.map(f64::from), 0.01).unwrap();
        assert!(distance(found.position, point) == 0.0);
    }
    assert_eq!(map.len(), cloud.len());
}

#[test]
fn removing_frames_leaves_the_surfaces_of_those_that_stay() {
    let (pose, mut random) = (Pose::identity(), SplitMix64::new(9));
    let frames: Vec<Frame> = (0..8).map(|time| noisy(&slanted_wall, time, &mut random)).collect();
    let empty = || CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let (mut shrunk, mut fresh) = (empty(), empty());
    for frame in &frames {
        shrunk.insert(frame, None, &pose).unwrap();
        shrunk.point_cloud(Selection::Static);
    }
    for frame in &frames[4..] {
        fresh.insert(frame, None, &pose).unwrap();
    }
    for frame in &frames[..4] {
        shrunk.remove(frame, None, &pose).unwrap();
    }
    assert_eq!(shrunk.point_cloud(Selection::Static), fresh.point_cloud(Selection::Static));
}

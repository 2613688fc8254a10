//! Objects as landmarks of the poses, where planes do not hold everything.
#![cfg(feature = "refine")]
use dymlm::{HistoryConfig, MapBuilder, MapConfig, RefineConfig, RefinedPoses};
use dymlm_core::{BoundingBox, Detection, PinholeCamera, Pose, SplitMix64};
use dymlm_test_support::{Cylinder, Rectangle, World, look_at, normal, small_camera};

/// Half the width of the corridor, metres.
const HALF_WIDTH: f64 = 1.2;
/// Height of its walls.
const HEIGHT: f64 = 2.5;
/// How far the camera goes along it. Its ends are too far to be seen.
const LENGTH: f64 = 8.0;
/// Height of the camera.
const EYE: f64 = 1.1;

/// Two walls, a floor, and bins along the walls.
fn corridor() -> World {
    let (middle, half) = (0.5 * LENGTH, LENGTH + 12.0);
    let wall = |y: f64| Rectangle::upright([middle, y, 0.5 * HEIGHT], half, 0.5 * HEIGHT);
    let floor = Rectangle::level([middle, 0.0, 0.0], half, HALF_WIDTH);
    let bin = |k: u32| {
        let side = if k.is_multiple_of(2) { 0.85 } else { -0.8 };
        let place = [1.3 * f64::from(k) - 4.0, side, 0.0];
        Cylinder { foot: place, radius: 0.14 + 0.01 * f64::from(k % 3), height: 0.5 }
    };
    World {
        rectangles: vec![wall(HALF_WIDTH), wall(-HALF_WIDTH), floor],
        cylinders: (0..13).map(bin).collect(),
        ..World::default()
    }
}

/// To the end of the corridor, about, and back.
fn there_and_back() -> Vec<Pose> {
    let [way, turn] = [40, 12];
    let look = |x: f64, angle: f64| {
        let target = [x + 3.0 * angle.cos(), 3.0 * angle.sin(), EYE - 0.9];
        look_at([x, 0.1 * (2.0 * x).sin(), EYE], target)
    };
    let along = |k: u32| LENGTH * f64::from(k) / f64::from(way);
    let angle = |k: u32| std::f64::consts::PI * f64::from(k) / f64::from(turn);
    let there = (0..way).map(|k| look(along(k), 0.0));
    let about = (0..turn).map(|k| look(LENGTH, angle(k)));
    let back = (0..=way).map(|k| look(LENGTH - along(k), std::f64::consts::PI));
    there.chain(about).chain(back).collect()
}

/// The boxes that a good detector finds: around the bins between 0.8 and 4.5 m that are wholly in view, 2 % of
/// their size too large or too small.
fn detections(world: &World, camera: &PinholeCamera, pose: &Pose, random: &mut SplitMix64) -> Vec<Detection> {
    let camera_from_world = pose.inverse();
    let mut seen = |bin: &Cylinder| {
        let depth = camera_from_world.transform_point(bin.foot)[2];
        let rims = (0..48_u32).map(|k| {
            let (sin, cos) = (f64::from(k / 2) * std::f64::consts::TAU / 24.0).sin_cos();
            let [x, y, z] = bin.foot;
            [x + bin.radius * cos, y + bin.radius * sin, z + f64::from(k % 2) * bin.height]
        });
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for place in rims {
            let pixel = camera.project(camera_from_world.transform_point(place))?;
            for axis in 0..2 {
                low[axis] = low[axis].min(pixel[axis]);
                high[axis] = high[axis].max(pixel[axis]);
            }
        }
        let mut noise = |axis: usize| 0.02 * (high[axis] - low[axis]) * normal(random);
        let sides = [low[0] + noise(0), low[1] + noise(1), high[0] + noise(0), high[1] + noise(1)];
        let [x_min, y_min, x_max, y_max] = sides.map(|side| side as f32);
        let is_in_view = low[0] > 0.0
            && low[1] > 0.0
            && high[0] < camera.width() as f64
            && high[1] < camera.height() as f64;
        let found = BoundingBox::new(x_min, y_min, x_max, y_max).ok()?;
        let detection = Detection::new("vase", 0.9, found).ok()?;
        ((0.8..4.5).contains(&depth) && is_in_view).then_some(detection)
    };
    world.cylinders.iter().filter_map(&mut seen).collect()
}

/// An odometry along a corridor drifts three times as far as in a room.
fn refine_config() -> RefineConfig {
    let mut config = RefineConfig::default();
    config.translation_per_second *= 3.0;
    config
}

/// Poses that drift as the config says: once a second.
fn drifted(truth: &[Pose], seed: u64) -> Vec<Pose> {
    let (config, mut random) = (refine_config(), SplitMix64::new(seed));
    let mut poses = vec![truth[0]];
    for pair in truth.windows(2) {
        let mut small = |deviation: f64| [(); 3].map(|()| deviation / 3.0_f64.sqrt() * normal(&mut random));
        let [x, y, z] = small(0.5 * config.rotation_per_second);
        let error = Pose::new(small(config.translation_per_second), [x, y, z, 1.0]).unwrap();
        poses.push(poses[poses.len() - 1] * pair[0].inverse() * pair[1] * error);
    }
    poses
}

/// The corridor, mapped at drifting poses and refined.
fn refined(seed: u64, with_objects: bool) -> ([f64; 2], RefinedPoses) {
    let (world, camera, truth) = (corridor(), small_camera(), there_and_back());
    let (poses, mut random) = (drifted(&truth, seed), SplitMix64::new(seed + 100));
    let mut config = MapConfig::default();
    // Poses are refined by planes and objects, whatever the cloud and the octree are like.
    (config.cloud.voxel_size, config.octree.resolution) = (0.06, 0.1);
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config).unwrap();
    for (index, (exact, pose)) in truth.iter().zip(&poses).enumerate() {
        let frame = world.frame(camera, exact, index as u64);
        let found = detections(&world, &camera, exact, &mut random);
        builder.insert(&frame, if with_objects { &found[..] } else { &[] }, pose).unwrap();
    }
    builder.settle();
    // Back at the start, along the corridor.
    let off = |pose: &Pose| (pose.translation()[0] - truth[truth.len() - 1].translation()[0]).abs();
    let before = off(&poses[poses.len() - 1]);
    let report = builder.refine_poses(&refine_config()).unwrap();
    let last = builder.trajectory().last().unwrap().2;
    ([before, off(&last)], report.found)
}

/// Walls and floor leave the way along a corridor to odometry; the bins, seen from both sides, hold some of it.
#[test]
#[ignore = "half a minute: .ci/nightly"]
fn objects_hold_the_way_along_a_corridor() {
    let mut squares = [0.0; 3];
    for seed in [1, 2] {
        let ([before, without], planes_only) = refined(seed, false);
        let ([_, with], found) = refined(seed, true);
        assert!(planes_only.objects == 0 && found.objects > 8 && found.object_views > 4 * found.objects);
        assert!(found.object_views_left_out == 0, "{found:?}");
        for (sum, error) in squares.iter_mut().zip([before, without, with]) {
            *sum += error * error;
        }
    }
    assert!(squares[1] > 0.8 * squares[0] && squares[2] < 0.7 * squares[1], "{squares:?}");
}

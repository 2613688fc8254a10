//! `CloudMap`: against a naive map, exact removal, order and merging, late ghost removal, refused input.

use std::collections::BTreeMap;

use dymlm_cloud::{CloudMap, CloudMapConfig, CloudVoxel, Error, MoverMasks, Selection, Support, Verdict};
use dymlm_core::vector3::{difference, norm};
use dymlm_core::{ColorImage, DepthImage, Frame, Mask, PinholeCamera, Point, Pose, Rgb, SensorModel};
use dymlm_geometry::OrientedBox;
use dymlm_test_support::{cases, recorded_frames, recording};
use proptest::prelude::*;

const WIDTH: usize = 48;
const HEIGHT: usize = 36;

fn camera() -> PinholeCamera {
    PinholeCamera::new(WIDTH, HEIGHT, 40.0, 40.0, 23.5, 17.5).unwrap()
}

/// Noise of the sensor.
fn sigma(z: f32) -> f32 {
    SensorModel::kinect().sigma(z)
}

fn config(voxel_size: f64) -> CloudMapConfig {
    let mut config = CloudMapConfig::default();
    config.voxel_size = voxel_size;
    config
}

#[test]
fn maps_go_between_threads() {
    fn is_shared<T: Send + Sync + Clone>() {}
    is_shared::<CloudMap>();
}

/// A frame whose depth is `depth(u, v)`, with a colour that depends on the pixel.
fn frame(timestamp: f64, depth: impl Fn(usize, usize) -> f32) -> Frame {
    let pixels = || (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (u, v)));
    let depth = pixels().map(|(u, v)| depth(u, v)).collect();
    let color = pixels().map(|(u, v)| [u as u8, v as u8, (u * v % 256) as u8]).collect();
    let depth = DepthImage::new(WIDTH, HEIGHT, depth).unwrap();
    let color = ColorImage::new(WIDTH, HEIGHT, color).unwrap();
    Frame::new(timestamp, camera(), depth, Some(color)).unwrap()
}

/// Uneven depths from 0.2 to 4.4 m, some of them missing.
fn uneven(seed: usize) -> Frame {
    frame(seed as f64, |u, v| {
        let value = (u * 7919 + v * 104_729 + seed * 1_299_709) % 1000;
        if value < 50 { 0.0 } else { 0.2 + value as f32 * 0.0042 }
    })
}

fn pose(seed: usize) -> Pose {
    let angle = 0.1 * seed as f64;
    let (sin, cos) = (angle / 2.0).sin_cos();
    let place = [0.05 * seed as f64, -0.03 * seed as f64, 0.02 * seed as f64];
    Pose::new(place, [0.6 * sin, 0.8 * sin, 0.0, cos]).unwrap()
}

fn voxels(map: &CloudMap) -> Vec<CloudVoxel> {
    map.voxels(Selection::All).collect()
}

/// The same map by the definition: exact positions in f64, voxels in a tree.
#[derive(Default)]
struct NaiveVoxel {
    weight: f64,
    position: [f64; 3],
    color: [f64; 3],
}

fn naive(frames: &[(Frame, Pose)], voxel_size: f64) -> BTreeMap<[i64; 3], NaiveVoxel> {
    let mut map: BTreeMap<[i64; 3], NaiveVoxel> = BTreeMap::new();
    for (frame, world_from_camera) in frames {
        for v in 0..HEIGHT {
            for u in 0..WIDTH {
                let z = frame.depth().at(u, v);
                if !(0.3..=4.5).contains(&z) {
                    continue;
                }
                let point = frame.camera().back_project([u as f64, v as f64], f64::from(z));
                let point = world_from_camera.transform_point(point);
                let weight = f64::from(sigma(0.4) / sigma(z)).powi(2);
                let voxel = map.entry(point.map(|c| (c / voxel_size).floor() as i64)).or_default();
                voxel.weight += weight;
                let color = frame.color().unwrap().at(u, v).unwrap();
                for axis in 0..3 {
                    voxel.position[axis] += weight * point[axis];
                    voxel.color[axis] += weight * f64::from(color[axis]);
                }
            }
        }
    }
    map
}

#[test]
fn agrees_with_the_naive_map() {
    // Voxels of 8 cm hold several readings each. A reading within rounding of a border may change sides: few
    // do.
    let frames: Vec<(Frame, Pose)> = (0..4).map(|seed| (uneven(seed), pose(seed))).collect();
    let mut map = CloudMap::new(config(0.08), SensorModel::kinect()).unwrap();
    for (frame, world_from_camera) in &frames {
        map.insert(frame, None, world_from_camera).unwrap();
    }
    let naive = naive(&frames, 0.08);
    let mut agreeing = 0;
    for voxel in map.voxels(Selection::All) {
        let key = voxel.position.map(|c| (f64::from(c) / 0.08).floor() as i64);
        let Some(expected) = naive.get(&key) else { continue };
        let near = |axis: usize| {
            (f64::from(voxel.position[axis]) - expected.position[axis] / expected.weight).abs() < 5e-4
                && (f64::from(voxel.color.unwrap()[axis]) - expected.color[axis] / expected.weight).abs()
                    <= 1.5
        };
        // Weights are multiples of 1/4096.
        let same_weight = (voxel.weight - expected.weight).abs() < 0.02 * expected.weight + 1e-3;
        agreeing += usize::from(same_weight && (0..3).all(near));
    }
    assert!(naive.len() > 1000);
    assert!(
        map.held_voxels().abs_diff(naive.len()) < naive.len() / 100,
        "{} and {}",
        map.held_voxels(),
        naive.len()
    );
    assert!(agreeing > naive.len() * 98 / 100, "{agreeing} of {}", naive.len());
}

#[test]
fn precision_does_not_fall_far_from_the_origin() {
    let wall = frame(0.0, |_, _| 2.0);
    let relative = |origin: [f64; 3]| -> Vec<[f64; 3]> {
        let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
        map.insert(&wall, None, &Pose::new(origin, [0.0, 0.0, 0.0, 1.0]).unwrap()).unwrap();
        map.voxels(Selection::All)
            .map(|v| std::array::from_fn(|axis| f64::from(v.position[axis]) - origin[axis]))
            .collect()
    };
    // 1 km away, where an f32 position itself is good to 0.06 mm.
    let (near, far) = (relative([0.0; 3]), relative([1000.0, -1000.0, 500.0]));
    assert!(!near.is_empty() && near.len() == far.len());
    for (near, far) in near.iter().zip(&far) {
        assert!((0..3).all(|axis| (near[axis] - far[axis]).abs() < 2e-4), "{near:?} {far:?}");
    }
}

/// At the greatest depth, 4.5 m, the readings in the corners lie 177 m away.
fn nearly_half_the_space() -> Frame {
    let camera = PinholeCamera::new(64, 48, 1.0, 1.0, 31.5, 23.5).unwrap();
    let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
    Frame::new(0.0, camera, depth, None).unwrap()
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_view_of_nearly_half_the_space_is_mapped() {
    let wide = nearly_half_the_space();
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    map.insert(&wide, None, &Pose::identity()).unwrap();
    let mut expected: Vec<[f64; 3]> = (0..64 * 48)
        .map(|pixel| wide.camera().back_project([pixel % 64, pixel / 64].map(f64::from), 2.0))
        .collect();
    let mut read: Vec<Point> = map.voxels(Selection::All).map(|voxel| voxel.position).collect();
    expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
    read.sort_by(|a, b| a.partial_cmp(b).unwrap());
    assert_eq!(read.len(), expected.len());
    for (read, expected) in read.iter().zip(&expected) {
        assert!((0..3).all(|axis| (f64::from(read[axis]) - expected[axis]).abs() < 1e-4), "{expected:?}");
    }
    map.remove(&wide, None, &Pose::identity()).unwrap();
    assert_eq!(map.held_voxels(), 0);
}

#[test]
fn a_view_that_takes_in_too_much_is_refused() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    // An image as large as the sensor has: 25 million blocks.
    let camera = PinholeCamera::new(640, 480, 1.0, 1.0, 319.5, 239.5).unwrap();
    let depth = DepthImage::new(640, 480, vec![2.0; 640 * 480]).unwrap();
    let wider = Frame::new(0.0, camera, depth, None).unwrap();
    let refused = map.insert(&wider, None, &Pose::identity()).unwrap_err();
    assert!(matches!(refused, Error::ViewTooLarge { volume, .. } if (volume - 819_200.0).abs() < 1.0));
    assert!(refused.to_string().contains("focal lengths"), "{refused}");
    // Regression: an image without readings was taken, and half a minute passed.
    let relative = PinholeCamera::new(640, 480, 0.8, 0.8, 319.5, 239.5).unwrap();
    let unread = Frame::new(0.0, relative, DepthImage::empty(640, 480).unwrap(), None).unwrap();
    let refused = map.insert(&unread, None, &Pose::identity()).unwrap_err();
    assert!(matches!(refused, Error::ViewTooLarge { .. }), "{refused}");
    assert_eq!(map.held_voxels(), 0);

    let far = Pose::new([0.0, 1e5, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let told = map.insert(&nearly_half_the_space(), None, &far).unwrap_err().to_string();
    assert!(told.contains("lie up to 176.9") && told.contains("narrower view"), "{told}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(6)))]

    #[test]
    fn the_order_of_frames_does_not_matter(order in Just((0..5).collect::<Vec<usize>>()).prop_shuffle()) {
        let build = |order: &[usize]| {
            let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
            for &seed in order {
                map.insert(&uneven(seed), None, &pose(seed)).unwrap();
            }
            voxels(&map)
        };
        prop_assert_eq!(build(&order), build(&[0, 1, 2, 3, 4]));
    }

    #[test]
    fn a_frame_is_taken_out_without_a_trace(removed in 0_usize..4, masked in any::<bool>()) {
        let mut mask = Mask::filled(WIDTH, HEIGHT, true).unwrap();
        (6..19).for_each(|v| mask.fill_row(v, 0..WIDTH, false));
        let mut movers = mask.inverted();
        (6..12).for_each(|v| movers.fill_row(v, 0..WIDTH, false));
        let mut unproven = mask.inverted();
        unproven.subtract(&movers).unwrap();
        let mask =
            masked.then(|| MoverMasks::new(&mask).with_movers(&movers).with_unproven(&unproven));
        let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
        let mut without = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
        for seed in 0..4 {
            map.insert(&uneven(seed), mask, &pose(seed)).unwrap();
            if seed != removed {
                without.insert(&uneven(seed), mask, &pose(seed)).unwrap();
            }
        }
        map.remove(&uneven(removed), mask, &pose(removed)).unwrap();
        prop_assert_eq!(voxels(&map), voxels(&without));
        prop_assert_eq!(map.held_voxels(), without.held_voxels());
        prop_assert_eq!(map.frames(), 3);
    }

    #[test]
    fn two_maps_add_up(split in 0_usize..=4) {
        let mut whole = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
        let mut halves = [whole.clone(), whole.clone()];
        for seed in 0..4 {
            whole.insert(&uneven(seed), None, &pose(seed)).unwrap();
            halves[usize::from(seed >= split)].insert(&uneven(seed), None, &pose(seed)).unwrap();
        }
        let [mut merged, other] = halves;
        merged.merge(&other).unwrap();
        prop_assert_eq!(voxels(&merged), voxels(&whole));
        prop_assert_eq!(merged.held_voxels(), whole.held_voxels());
        // And a frame of the other map can be taken out.
        merged.remove(&uneven(3), None, &pose(3)).unwrap();
        whole.remove(&uneven(3), None, &pose(3)).unwrap();
        prop_assert_eq!(voxels(&merged), voxels(&whole));
    }
}

/// A wall, noisy or not, far enough for thinning, and somebody who walks before it.
fn walked_through(seed: usize) -> (Frame, Pose) {
    let wall = noisy_wall(seed as u32, 3.3, &SensorModel::kinect());
    let columns = seed * 7 % 30..seed * 7 % 30 + 8;
    let frame = frame(seed as f64, |u, v| match () {
        () if columns.contains(&u) => 1.2,
        () if seed < 4 => wall.depth().at(u, v),
        () => 3.305,
    });
    (frame, Pose::new([0.004 * seed as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap())
}

/// Changes a map in one of seven ways.
fn apply(map: &mut CloudMap, step: u8, seed: usize) {
    let (frame, pose) = walked_through(seed);
    match step {
        // Some are not in the map, or have been moved: refusals change nothing either.
        0 | 1 => map.remove(&frame, None, &pose).unwrap_or_default(),
        2 => {
            let mut other = CloudMap::new(map.config().clone(), SensorModel::kinect()).unwrap();
            other.insert(&frame, None, &pose).unwrap();
            map.merge(&other).unwrap();
        }
        3 => {
            let wall = Pose::new([0.0, 0.0, 3.3], [0.0, 0.0, 0.0, 1.0]).unwrap();
            let shifted = Pose::new([0.0, 0.013 * seed as f64, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
            map.move_body(&OrientedBox::new(wall, [0.3; 3]).unwrap(), &shifted, |_| true);
        }
        4 => map.forget_outside([0.05 * seed as f64, 0.0, 3.0], 0.5 + 0.2 * seed as f64),
        _ => drop(map.insert(&frame, None, &pose).unwrap()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(6)))]

    #[test]
    fn reading_in_between_changes_nothing(
        steps in prop::collection::vec((0_u8..7, 0_usize..9), 4..14),
        fuse_surfaces: bool,
    ) {
        let mut config = config(0.01);
        config.fuse_surfaces = fuse_surfaces;
        let mut silent = CloudMap::new(config, SensorModel::kinect()).unwrap();
        let mut read = silent.clone();
        for seed in 0..8 {
            apply(&mut silent, 5, seed);
            apply(&mut read, 5, seed);
        }
        for (step, seed) in steps {
            apply(&mut silent, step, seed);
            read.verdicts();
            apply(&mut read, step, seed);
            prop_assert_eq!(read.len(), read.point_cloud(Selection::Static).len());
        }
        let static_points: Vec<Point> = read.voxels(Selection::Static).map(|voxel| voxel.position).collect();
        prop_assert_eq!(voxels(&read), voxels(&silent));
        let cloud = read.point_cloud(Selection::Static);
        if !fuse_surfaces {
            prop_assert_eq!(cloud.points(), static_points);
        }
        prop_assert_eq!(cloud, silent.point_cloud(Selection::Static));
    }
}

/// Two robots go on from one map, each in a room of its own: what one has is not what the other has.
#[test]
fn changes_between_clones_that_both_went_on_lead_from_one_to_the_other() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for seed in 0..4 {
        map.insert(&uneven(seed), None, &pose(seed)).unwrap();
    }
    let [mut a, mut b] = [map.clone(), map];
    for (map, x) in [(&mut a, 20.0), (&mut b, -20.0)] {
        for seed in 0..4 {
            let room = Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
            map.insert(&uneven(seed), None, &(room * pose(seed))).unwrap();
        }
    }
    for (new, old) in [(&a, &b), (&b, &a)] {
        let mut copy = blocks_of(old);
        for block in new.changes_since(old) {
            copy.insert(block.place, block.points);
        }
        copy.retain(|_, points| !points.is_empty());
        assert!(copy == blocks_of(new));
    }
}

/// The static points by blocks.
fn blocks_of(map: &CloudMap) -> std::collections::BTreeMap<[i32; 3], Vec<Point>> {
    let nothing = CloudMap::new(map.config().clone(), SensorModel::kinect()).unwrap();
    map.changes_since(&nothing).into_iter().map(|block| (block.place, block.points)).collect()
}

#[test]
fn what_is_far_is_forgotten_and_what_is_near_stays() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for seed in 0..4 {
        map.insert(&uneven(seed), None, &pose(seed)).unwrap();
    }
    let before = voxels(&map);
    let (bytes, center, radius) = (map.memory_bytes(), [0.0, 0.0, 1.5], 1.2);
    map.forget_outside(center, 1e3);
    assert_eq!(voxels(&map), before, "nothing is that far");

    map.forget_outside(center, radius);
    let distance = |voxel: &CloudVoxel| norm(difference(voxel.position.map(f64::from), center));
    let left = voxels(&map);
    let block = 8.0 * map.verdicts().cell_size() * 3_f64.sqrt();
    assert!(left.iter().all(|voxel| distance(voxel) <= radius + block));
    let places = |voxels: &[CloudVoxel]| -> Vec<(Point, u32, Support)> {
        let near = voxels.iter().filter(|voxel| distance(voxel) <= radius);
        near.map(|voxel| (voxel.position, voxel.observations, voxel.evidence)).collect()
    };
    assert_eq!(places(&left), places(&before));
    assert_eq!(map.held_voxels(), left.len());
    assert!((1..before.len()).contains(&left.len()) && map.memory_bytes() < bytes);
    assert!(matches!(map.remove(&uneven(0), None, &pose(0)), Err(Error::NotInserted { .. })));
    assert_eq!(voxels(&map), left);

    map.forget_outside([1e6; 3], 1.0);
    assert!(map.is_empty() && map.held_voxels() == 0);
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_recording_read_after_each_frame_gives_the_cloud_that_is_read_once() {
    let Some(folder) = recording("kitchen_people") else { return };
    let mut read = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let mut silent = read.clone();
    for (step, recorded) in recorded_frames(&folder).skip(130).step_by(4).enumerate() {
        for map in [&mut read, &mut silent] {
            map.insert(&recorded.frame, None, &recorded.world_from_camera).unwrap();
        }
        let cloud = read.point_cloud(Selection::Static);
        if step.is_multiple_of(5) {
            // The copy of a map that was never read knows nothing yet.
            assert_eq!(cloud, silent.clone().point_cloud(Selection::Static), "after {step} frames");
        }
    }
    assert!(read.len() > 100_000);
}

/// Somebody stands 1.2 m from the camera, before a wall at 2.4 m, in the pixels of these columns.
fn person_before_wall(timestamp: f64, columns: std::ops::Range<usize>) -> Frame {
    frame(timestamp, |u, _| if columns.contains(&u) { 1.2 } else { 2.4 })
}

fn ghosts(cloud: &[Point]) -> usize {
    cloud.iter().filter(|point| point[2] < 2.0).count()
}

#[test]
fn what_walks_by_unnoticed_is_removed_late() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..8 {
        // Four columns on each frame: 12 cm at 1.2 m. Every place is taken once and free seven times.
        let frame = person_before_wall(f64::from(step), step as usize * 4 + 4..step as usize * 4 + 8);
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    assert!(ghosts(map.point_cloud(Selection::All).points()) > 500);
    let cloud = map.point_cloud(Selection::Static);
    assert_eq!(ghosts(cloud.points()), 0);
    // The wall stays, whole.
    let wall = |cloud: &[Point]| cloud.iter().filter(|point| point[2] > 2.3).count();
    assert_eq!(wall(cloud.points()), wall(map.point_cloud(Selection::All).points()));
}

#[test]
fn a_ghost_seen_last_is_removed_by_the_frames_before_it() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..5 {
        map.insert(&person_before_wall(f64::from(step), 0..0), None, &Pose::identity()).unwrap();
    }
    map.insert(&person_before_wall(5.0, 20..24), None, &Pose::identity()).unwrap();
    assert_eq!(ghosts(map.point_cloud(Selection::Static).points()), 0);
}

#[test]
fn a_movers_trace_beside_a_long_seen_surface_is_removed() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    for step in 0..100 {
        // A cupboard at 1.5 m in the left half, for two frames somebody beside it, a wall behind.
        let in_front = if step == 50 || step == 51 { 24 } else { 20 };
        let frame = frame(f64::from(step), |u, _| if u < in_front { 1.5 } else { 2.5 });
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    let beside = |cloud: &[Point]| cloud.iter().filter(|point| point[2] < 2.0 && point[0] > -0.15).count();
    assert!(beside(map.point_cloud(Selection::All).points()) > 100);
    assert_eq!(beside(map.point_cloud(Selection::Static).points()), 0);
}

#[test]
fn where_somebody_walks_to_and_fro_nothing_stands() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    // A post of 12 cm stands on the left. On the right, somebody 18 cm wide walks 36 cm and back, for a minute at
    // 10 Hz: up to half of the frames read a place on his way, as many as read the rim of a thing.
    for step in 0..600_u32 {
        let walked = 12 - (step % 24).abs_diff(12) as usize;
        let person = 26 + walked..32 + walked;
        let frame = frame(f64::from(step) / 10.0, |u, _| match u {
            4..8 => 1.2,
            u if person.contains(&u) => 1.2,
            _ => 2.4,
        });
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    let cloud = map.point_cloud(Selection::Static);
    let in_front = |points: &[Point], side: f32| {
        points.iter().filter(|point| point[2] < 2.0 && side * point[0] > 0.0).count()
    };
    assert!(in_front(map.point_cloud(Selection::All).points(), 1.0) > 500);
    assert_eq!(in_front(cloud.points(), 1.0), 0);
    assert_eq!(in_front(cloud.points(), -1.0), in_front(map.point_cloud(Selection::All).points(), -1.0));
}

/// A wall at `depth` as a noisy sensor reads it: normal noise of the axial deviation, the same for every
/// seed.
fn noisy_wall(seed: u32, depth: f32, sensor: &SensorModel) -> Frame {
    frame(f64::from(seed), |u, v| {
        let uniform = |k: u32| {
            let mixed = [u as u32, v as u32, seed, k].into_iter().fold(0x9E37_79B9_u32, |hash, part| {
                // The finalizer of MurmurHash3.
                let hash = (hash ^ part ^ (hash >> 16)).wrapping_mul(0x85EB_CA6B);
                let hash = (hash ^ (hash >> 13)).wrapping_mul(0xC2B2_AE35);
                hash ^ (hash >> 16)
            });
            (mixed >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        // The sum of four uniform numbers has deviation 1 / sqrt(3).
        depth + sensor.sigma(depth) * 3_f32.sqrt() * (0..4).map(uniform).sum::<f32>()
    })
}

#[test]
fn a_far_noisy_surface_is_thinned_and_keeps_no_hole_whatever_the_sensor() {
    for sensor in [SensorModel::kinect(), SensorModel::realsense_d4xx(), SensorModel::time_of_flight()] {
        let mut map = CloudMap::new(config(0.01), sensor).unwrap();
        for seed in 0..80 {
            map.insert(&noisy_wall(seed, 3.5, &sensor), None, &Pose::identity()).unwrap();
        }
        let distances = |selection| -> Vec<f32> {
            let cloud = map.point_cloud(selection);
            let mut distances: Vec<f32> = cloud.points().iter().map(|point| (point[2] - 3.5).abs()).collect();
            distances.sort_by(f32::total_cmp);
            distances
        };
        let quantile = |distances: &[f32], percent: usize| distances[distances.len() * percent / 100];
        let (all, thinned) = (distances(Selection::All), distances(Selection::Static));
        let (sigma, half_voxel) = (sensor.sigma(3.5), 0.005);
        assert!(quantile(&all, 95) > 2.0 * sigma, "{sensor:?}: {}", quantile(&all, 95));
        assert!(quantile(&thinned, 95) < 1.9 * sigma + half_voxel, "{sensor:?}: {}", quantile(&thinned, 95));
        assert!(quantile(&thinned, 50) < 0.9 * sigma + half_voxel, "{sensor:?}: {}", quantile(&thinned, 50));
        // No hole: each pixel's line of sight keeps a voxel.
        assert!(thinned.len() > WIDTH * HEIGHT, "{sensor:?}: {} voxels", thinned.len());
    }
}

#[test]
fn what_was_seen_from_near_is_left_as_it_is() {
    // At 0.5 m the deviation is 1.2 mm. The wall lies across a border of voxels, so that one layer is
    // heavier.
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    for seed in 0..10 {
        map.insert(&noisy_wall(seed, 0.5, &SensorModel::kinect()), None, &Pose::identity()).unwrap();
    }
    let noise = map.voxels(Selection::All).filter(|voxel| voxel.verdict == Verdict::Noise);
    assert!(noise.map(|voxel| voxel.observations).all(|observations| observations < 2));
}

#[test]
fn thinning_can_be_turned_off() {
    let mut config = config(0.01);
    config.min_observations = 1;
    config.thinning_radius = 0.0;
    let mut map = CloudMap::new(config, SensorModel::kinect()).unwrap();
    map.insert(&noisy_wall(0, 3.5, &SensorModel::kinect()), None, &Pose::identity()).unwrap();
    assert_eq!(map.point_cloud(Selection::Static), map.point_cloud(Selection::All));
}

#[test]
fn a_wrong_verdict_heals() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..3 {
        map.insert(&person_before_wall(f64::from(step), 0..0), None, &Pose::identity()).unwrap();
    }
    // A cupboard is put there, and stays.
    let cupboard = |step: u32| person_before_wall(f64::from(step), 16..32);
    map.insert(&cupboard(3), None, &Pose::identity()).unwrap();
    assert_eq!(ghosts(map.point_cloud(Selection::Static).points()), 0);
    for step in 4..10 {
        map.insert(&cupboard(step), None, &Pose::identity()).unwrap();
    }
    assert_eq!(
        ghosts(map.point_cloud(Selection::Static).points()),
        ghosts(map.point_cloud(Selection::All).points())
    );
}

#[test]
fn masked_pixels_are_not_mapped() {
    let mut mask = Mask::filled(WIDTH, HEIGHT, true).unwrap();
    (0..HEIGHT).for_each(|v| mask.fill_row(v, 20..24, false));
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    let report = map
        .insert(&person_before_wall(0.0, 20..24), Some(MoverMasks::new(&mask)), &Pose::identity())
        .unwrap();
    assert_eq!(report.readings, (WIDTH - 4) * HEIGHT);
    assert_eq!(report.voxels, report.new_voxels);
    assert_eq!(report.voxels, map.held_voxels());
    assert_eq!(ghosts(map.point_cloud(Selection::All).points()), 0);
}

/// Inserts frames of a wall at a depth, from a time on, for so many seconds and at so many frames a second.
fn insert_walls(map: &mut CloudMap, from: f64, [seconds, rate]: [f64; 2], depth: f32) {
    for step in 0..(seconds * rate) as usize {
        map.insert(&frame(from + step as f64 / rate, |_, _| depth), None, &Pose::identity()).unwrap();
    }
}

#[test]
fn a_single_look_from_near_leaves_no_hole_in_what_was_seen_from_afar() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let camera = PinholeCamera::new(160, 120, 525.0, 525.0, 79.5, 59.5).unwrap();
    let mut look = |time: f64, depth: f32, z: f64| {
        let depth = DepthImage::new(160, 120, vec![depth; 160 * 120]).unwrap();
        let pose = Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
        map.insert(&Frame::new(time, camera, depth, None).unwrap(), None, &pose).unwrap();
        let cloud = map.point_cloud(Selection::Static);
        cloud.points().iter().filter(|point| point[0].abs() < 0.05 && point[1].abs() < 0.05).count()
    };
    look(0.0, 3.005, 0.0);
    let before = look(0.1, 3.005, 0.0);
    // The wall is a centimetre nearer for a camera close to it, since poses drift.
    let after = look(0.2, 0.615, 2.38);
    assert!(before > 50 && 10 * after > 9 * before, "{before} points before, {after} after");
}

/// Whether a wall is believed that frames show for so long in a place that was empty until a time.
fn believes_a_new_wall(empty: &CloudMap, until: f64, shown: [f64; 2]) -> bool {
    let mut map = empty.clone();
    insert_walls(&mut map, until, shown, 1.2);
    let cloud = map.point_cloud(Selection::Static);
    let near = ghosts(cloud.points());
    // The wall covers what was behind it, which stays as it was.
    assert!(near == 0 || near > 100, "{near}");
    near > 0
}

#[test]
fn a_new_wall_is_believed_within_ten_seconds() {
    for (empty, rates) in [
        ([10.0, 2.0], [2.0].as_slice()),
        ([10.0, 30.0], &[30.0]),
        ([300.0, 2.0], &[2.0, 30.0]),
        ([1200.0, 0.4], &[2.0, 30.0]),
    ] {
        let (mut map, until) = (CloudMap::new(config(0.02), SensorModel::kinect()).unwrap(), 0.3 + empty[0]);
        insert_walls(&mut map, 0.3, empty, 2.4);
        for &rate in rates {
            assert!(believes_a_new_wall(&map, until, [10.0, rate]), "{rate} Hz, after {empty:?}");
            assert!(!believes_a_new_wall(&map, until, [1.5, rate]), "{rate} Hz, after {empty:?}");
        }
    }
}

#[test]
fn what_was_taken_away_is_gone_within_three_seconds() {
    for rate in [2.0, 30.0] {
        let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
        insert_walls(&mut map, 0.0, [300.0, 2.0], 1.2);
        assert!(ghosts(map.point_cloud(Selection::Static).points()) > 100);
        insert_walls(&mut map, 300.4, [3.0, rate], 2.4);
        assert_eq!(ghosts(map.point_cloud(Selection::Static).points()), 0, "{rate} Hz");
    }
}

#[test]
fn what_was_read_the_day_before_is_known_to_be_gone() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..20 {
        map.insert(&person_before_wall(f64::from(step), 16..24), None, &Pose::identity()).unwrap();
    }
    let place = frame(0.0, |_, _| 1.2).camera().back_project([20.0, 12.0], 1.2);
    assert_eq!(map.verdicts().is_free(place), Some(false));
    for step in 0..20 {
        let time = 86_400.0 + f64::from(step);
        map.insert(&person_before_wall(time, 0..0), None, &Pose::identity()).unwrap();
    }
    assert_eq!(map.verdicts().is_free(place), Some(true));
    assert_eq!(ghosts(map.point_cloud(Selection::Static).points()), 0);
}

#[test]
fn a_wall_that_is_hidden_for_a_day_stays() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..20 {
        map.insert(&person_before_wall(f64::from(step), 0..0), None, &Pose::identity()).unwrap();
    }
    let wall = map.point_cloud(Selection::Static);
    // A locker is put before a part of it, and the rest is seen day and night: in the same blocks.
    for step in 0..400 {
        let time = 60.0 + 216.0 * f64::from(step);
        map.insert(&person_before_wall(time, 16..24), None, &Pose::identity()).unwrap();
    }
    let now = map.point_cloud(Selection::Static);
    let hidden = |cloud: &[Point]| cloud.iter().filter(|at| at[2] > 2.3 && at[0].abs() < 0.1).count();
    assert!(hidden(wall.points()) > 20);
    assert_eq!(hidden(now.points()), hidden(wall.points()));
}

#[test]
fn a_wall_that_was_taken_away_leaves_no_strip_above_the_floor() {
    let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
    // The floor is 0.5 m below the camera, the wall 2 m ahead.
    let depth = |wall: bool| -> Vec<f32> {
        let floor = |v: u32| if v > 60 { 0.5 * 130.0 / (v as f32 - 59.5) } else { 4.0 };
        let row = |v: u32| floor(v).min(if wall { 2.0 } else { 4.0 });
        (0..160 * 120).map(|pixel| row(pixel / 160)).collect()
    };
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let mut insert = |time: f64, wall: bool| {
        let depth = DepthImage::new(160, 120, depth(wall)).unwrap();
        let pose = Pose::new([0.002 * (time % 7.0), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        map.insert(&Frame::new(time, camera, depth, None).unwrap(), None, &pose).unwrap();
    };
    (0..60).for_each(|step| insert(f64::from(step) / 2.0, true));
    (60..80).for_each(|step| insert(f64::from(step) / 2.0, false));
    let cloud = map.point_cloud(Selection::Static);
    let at_wall = |low: f32, high: f32| {
        let is_at = |p: &&Point| p[0].abs() < 0.5 && (p[2] - 2.0).abs() < 0.06 && p[1] > low && p[1] < high;
        cloud.points().iter().filter(is_at).count()
    };
    assert!(at_wall(0.49, 0.51) > 100, "the floor: {} points", at_wall(0.49, 0.51));
    assert_eq!(at_wall(-0.5, 0.48), 0);
}

/// Somebody sits in columns 20 to 30 and is masked but in every tenth frame; the mask takes column 31 of the
/// chair, too, in every third.
fn insert_sitting(map: &mut CloudMap, step: usize) {
    let end = if step.is_multiple_of(3) { 32 } else { 31 };
    let mut mask = Mask::filled(WIDTH, HEIGHT, true).unwrap();
    if !step.is_multiple_of(10) {
        (0..HEIGHT).for_each(|v| mask.fill_row(v, 20..end, false));
    }
    let movers = mask.inverted();
    let masks = MoverMasks::new(&mask).with_movers(&movers);
    let frame = person_before_wall(step as f64 / 30.0, 20..36);
    map.insert(&frame, Some(masks), &Pose::identity()).unwrap();
}

#[test]
fn who_sits_is_not_mapped_where_the_detector_misses_and_what_stands_beside_is() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    (0..300).for_each(|step| insert_sitting(&mut map, step));
    let camera = camera();
    let columns = |cloud: &[Point]| -> Vec<usize> {
        let near = cloud.iter().filter(|point| point[2] < 2.0);
        let mut columns: Vec<usize> = near
            .map(|point| (f64::from(point[0] / point[2]) * camera.fx() + camera.cx()).round() as usize)
            .collect();
        columns.sort_unstable();
        columns.dedup();
        columns
    };
    assert!(columns(map.point_cloud(Selection::All).points()).contains(&25));
    let cloud = map.point_cloud(Selection::Static);
    let seen = columns(cloud.points());
    assert!(seen.iter().all(|&u| u > 29), "{seen:?}");
    assert!((32..35).all(|u| seen.contains(&u)), "the chair: {seen:?}");

    // Who leaves uncovers nothing but free space: no trace is left.
    for step in 300..450 {
        let frame = person_before_wall(f64::from(step) / 30.0, 31..36);
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    let seen = columns(map.point_cloud(Selection::Static).points());
    assert!(seen.iter().all(|&u| u > 29) && seen.contains(&31), "{seen:?}");
}

#[test]
fn where_somebody_stays_is_not_free_until_frames_look_through() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    (0..300).filter(|step| step % 10 != 0).for_each(|step| insert_sitting(&mut map, step));
    let place = camera().back_project([25.0, 18.0], 1.2);
    assert_eq!(map.verdicts().at(place), Some(Verdict::Ghost));
    assert_eq!(map.verdicts().is_free(place), Some(false));
    for step in 300..400 {
        let frame = person_before_wall(f64::from(step) / 30.0, 31..36);
        map.insert(&frame, None, &Pose::identity()).unwrap();
    }
    assert_eq!(map.verdicts().is_free(place), Some(true));
}

#[test]
fn what_is_unproven_is_not_mapped_and_speaks_for_its_place() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let columns = 20..31;
    let mut mask = Mask::filled(WIDTH, HEIGHT, true).unwrap();
    (0..HEIGHT).for_each(|v| mask.fill_row(v, columns.clone(), false));
    let unproven = mask.inverted();
    let masks = MoverMasks::new(&mask).with_unproven(&unproven);
    for step in 0..5 {
        let frame = person_before_wall(f64::from(step) / 30.0, columns.clone());
        map.insert(&frame, Some(masks), &Pose::identity()).unwrap();
    }
    let is_near = |cloud: &[Point]| cloud.iter().any(|point| point[2] < 2.0);
    assert!(!is_near(map.point_cloud(Selection::All).points()));
    let person = person_before_wall(1.0, columns.clone());
    let z = f64::from(person.depth().at(25, HEIGHT / 2));
    let place = camera().back_project([25.0, (HEIGHT / 2) as f64], z);
    assert_eq!(map.verdicts().at(place), Some(Verdict::Static));

    // Proved to stay, it is mapped.
    for _ in 0..2 {
        map.insert(&person, None, &Pose::identity()).unwrap();
    }
    assert!(is_near(map.point_cloud(Selection::Static).points()));
}

/// Something that every frame reads ends where blocks of cells meet, and what some frames read goes on in the
/// next block. That hears only through its neighbours that the thing was taken away.
#[test]
fn whoever_follows_the_verdicts_is_told_where_something_has_become_a_ghost() {
    let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
    let insert = |map: &mut CloudMap, step: usize, depth: &dyn Fn(usize, usize) -> f32| {
        let depth = (0..160 * 120).map(|pixel| depth(pixel % 160, pixel / 160)).collect();
        let depth = DepthImage::new(160, 120, depth).unwrap();
        let frame = Frame::new(0.5 * step as f64, camera, depth, None).unwrap();
        map.insert(&frame, None, &Pose::identity()).unwrap();
    };
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    for step in 0..60 {
        // The lower a row, the more frames read something in it.
        insert(&mut map, step, &|u, v| if u >= 80 || step * 7 % 20 <= v / 6 { 1.2 } else { 2.4 });
    }
    let static_places = |map: &CloudMap| {
        let points = voxels(map).into_iter().map(|voxel| voxel.position.map(f64::from));
        let verdicts = map.verdicts();
        points.filter(|place| verdicts.at(*place) == Some(Verdict::Static)).collect::<Vec<_>>()
    };
    let mut beside = 0;
    for step in 60..100 {
        let before = static_places(&map);
        let revision = map.evidence_revision();
        insert(&mut map, step, &|u, _| if u > 80 { 2.4 } else { 0.0 });
        let verdicts = map.verdicts();
        let told: Vec<[[f64; 3]; 2]> = verdicts.ghost_boxes_since(revision).collect();
        for place in before.into_iter().filter(|place| verdicts.at(*place) == Some(Verdict::Ghost)) {
            let holds = |[low, high]: &[[f64; 3]; 2]| {
                (0..3).all(|axis| (low[axis]..=high[axis]).contains(&place[axis]))
            };
            assert!(told.iter().any(holds), "{place:?} at step {step}");
            assert!(verdicts.changed_bounds_since(revision).iter().any(holds));
            beside += usize::from(place[0] < 0.0);
        }
    }
    assert!(beside > 0);
}

#[test]
fn no_margin_is_too_large_to_ask_for() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    let place = [0.0, 0.0, 1.2];
    insert_walls(&mut map, 0.0, [5.0, 10.0], 2.4);
    // The wall is 1.2 m away.
    for (margin, is_free) in [
        (0.0, true),
        (0.9, true),
        (1.3, false),
        (50.0, false),
        (1e9, false),
        (f64::MAX, false),
        (f64::INFINITY, false),
        (f64::NAN, false),
        (-1.0, false),
        (f64::NEG_INFINITY, false),
    ] {
        assert_eq!(map.is_long_free(place, margin), is_free, "{margin} m");
    }
}

#[test]
fn space_is_long_free_where_frames_looked_through_before_the_current_epoch() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let insert = |map: &mut CloudMap, times: std::ops::Range<i32>, z: f32| {
        for time in times {
            map.insert(&frame(0.1 * f64::from(time), |_, _| z), None, &Pose::identity()).unwrap();
        }
    };
    let [before, at_wall, behind] = [1.2, 2.4, 3.0].map(|z| [0.0, 0.0, z]);
    assert!(!map.is_long_free(before, 0.0), "nothing was seen");
    insert(&mut map, 0..50, 2.4);
    assert!(map.is_long_free(before, 0.0) && map.is_long_free(before, 0.1));
    assert!(!map.is_long_free(at_wall, 0.0) && !map.is_long_free(behind, 0.0));
    let beside_wall = [0.0, 0.0, 2.27];
    assert!(map.is_long_free(beside_wall, 0.0) && !map.is_long_free(beside_wall, 0.16));
    // Somebody comes: what is read of him does not make the place his.
    insert(&mut map, 50..70, 1.2);
    assert!(map.is_long_free(before, 0.1));
    // Who stays is no longer new.
    insert(&mut map, 70..140, 1.2);
    assert!(!map.is_long_free(before, 0.0));
    assert!(!map.is_long_free([f64::NAN; 3], 0.0) && !map.is_long_free([1e12; 3], 0.0));
}

/// What is taken out of an old frame, or comes late, does not make its time the present; nor does a map
/// that is merged.
#[test]
fn the_present_is_that_of_the_newest_frame_whatever_is_taken_out_or_added() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    let place = [0.0, 0.0, 1.2];
    let shown = |step: i32| frame(0.1 * f64::from(step), |_, _| if step < 50 { 2.4 } else { 1.2 });
    let mut early = map.clone();
    for step in 0..70 {
        map.insert(&shown(step), None, &Pose::identity()).unwrap();
    }
    for step in 0..5 {
        early.insert(&shown(step), None, &Pose::identity()).unwrap();
    }
    assert!(map.is_long_free(place, 0.0), "what is new there does not count");
    let (mut a, mut b) = (map.clone(), early.clone());
    a.merge(&early).unwrap();
    b.merge(&map).unwrap();
    assert_eq!([a.is_long_free(place, 0.0), b.is_long_free(place, 0.0)], [true; 2]);
    for step in 0..5 {
        map.remove(&shown(step), None, &Pose::identity()).unwrap();
        assert!(map.is_long_free(place, 0.0), "frame {step}");
    }
    for step in 0..5 {
        map.insert(&shown(step), None, &Pose::identity()).unwrap();
        assert!(map.is_long_free(place, 0.0), "frame {step}, inserted late");
    }
}

#[test]
fn old_frames_that_are_taken_out_leave_no_more_memory_taken() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    insert_walls(&mut map, 0.0, [60.0, 5.0], 2.4);
    let before = map.memory_bytes();
    for step in 0..20 {
        map.remove(&frame(f64::from(step) / 5.0, |_, _| 2.4), None, &Pose::identity()).unwrap();
    }
    assert!(map.memory_bytes() <= before, "{} after {before} bytes", map.memory_bytes());
}

/// A time at which nothing was inserted once joined the periods of all evidence before it.
#[test]
fn a_refused_removal_leaves_what_is_known_of_time() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    insert_walls(&mut map, 0.0, [25.0, 2.0], 2.4);
    insert_walls(&mut map, 25.0, [10.0, 2.0], 1.2);
    let known = |map: &CloudMap| {
        let verdict = map.verdicts().at([0.0, 0.0, 1.2]);
        (verdict, map.point_cloud(Selection::Static), map.evidence_revision())
    };
    let before = known(&map);
    assert_eq!(before.0, Some(Verdict::Static));
    let refused = map.remove(&frame(4000.0, |_, _| 1.2), None, &Pose::identity());
    assert!(matches!(refused, Err(Error::NotInserted { .. })));
    assert!(known(&map) == before);
    insert_walls(&mut map, 35.0, [1.0, 2.0], 1.2);
    assert_eq!(known(&map).0, Some(Verdict::Static));
}

#[test]
fn a_place_tells_since_when_and_until_when_it_was_occupied() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    let insert = |map: &mut CloudMap, times: std::ops::Range<i32>, z: f32| {
        for time in times {
            map.insert(&frame(f64::from(time), |_, _| z), None, &Pose::identity()).unwrap();
        }
    };
    let place = [0.0, 0.0, 1.2];
    assert_eq!(map.history(place).occupied_since(), None);
    insert(&mut map, 0..100, 2.4);
    insert(&mut map, 100..200, 1.2);
    let since = map.history(place).occupied_since().unwrap();
    assert!((60.0..=100.0).contains(&since), "{since}: old periods are long");
    assert_eq!(map.history(place).occupied_until(), Some(200.0));
    insert(&mut map, 200..300, 2.4);
    let history = map.history(place);
    assert_eq!(history.occupied_since(), None);
    let until = history.occupied_until().unwrap();
    assert!((200.0..=240.0).contains(&until), "{until}");
    assert_eq!(map.history([1e9, 0.0, f64::NAN]).periods, []);
}

#[test]
fn evidence_counts_frames_for_and_against() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    map.insert(&person_before_wall(0.0, 10..40), None, &Pose::identity()).unwrap();
    map.insert(&person_before_wall(1.0, 10..40), None, &Pose::identity()).unwrap();
    for step in 2..9 {
        map.insert(&person_before_wall(f64::from(step), 0..0), None, &Pose::identity()).unwrap();
    }
    let centre = map
        .voxels(Selection::All)
        .find(|voxel| {
            voxel.position[2] < 2.0 && voxel.position[0].abs() < 0.05 && voxel.position[1].abs() < 0.05
        })
        .unwrap();
    assert_eq!((centre.evidence.support, centre.evidence.looked_through), (2, 7));
    assert_eq!((centre.observations, centre.verdict), (2, Verdict::Ghost));
}

#[test]
fn refused_input_changes_nothing() {
    let mut map = CloudMap::new(config(0.02), SensorModel::kinect()).unwrap();
    map.insert(&uneven(0), None, &pose(0)).unwrap();
    let before = voxels(&map);

    let small_mask = Mask::filled(2, 2, true).unwrap();
    let error = map.insert(&uneven(1), Some(MoverMasks::new(&small_mask)), &pose(1)).unwrap_err();
    assert_eq!(error.to_string(), "the static mask has 2x2 pixels, the camera 48x36");

    for place in [1e9, -1e9, 1.7e5, f64::MAX] {
        let far = Pose::new([place, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        assert!(matches!(map.insert(&uneven(1), None, &far), Err(Error::OutOfReach { .. })));
        assert!(matches!(map.check_reach(&uneven(1), &far), Err(Error::OutOfReach { .. })));
    }

    // Never inserted; inserted from elsewhere; inserted without that mask.
    assert!(matches!(map.remove(&uneven(1), None, &pose(1)), Err(Error::NotInserted { .. })));
    assert!(matches!(map.remove(&uneven(0), None, &pose(1)), Err(Error::NotInserted { .. })));
    let mut mask = Mask::filled(WIDTH, HEIGHT, true).unwrap();
    mask.fill_row(0, 0..WIDTH, false);
    assert!(matches!(
        map.remove(&uneven(0), Some(MoverMasks::new(&mask)), &pose(0)),
        Err(Error::NotInserted { .. })
    ));
    // Without any reading in range: only the evidence can tell.
    let beyond = frame(0.0, |_, _| 5.0);
    assert!(matches!(map.remove(&beyond, None, &pose(0)), Err(Error::NotInserted { .. })));

    let other = CloudMap::new(config(0.03), SensorModel::kinect()).unwrap();
    assert!(matches!(map.merge(&other), Err(Error::DifferentConfigs)));

    assert_eq!(voxels(&map), before);
    assert_eq!(map.frames(), 1);
}

#[test]
fn degenerate_frames_give_empty_maps() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    assert!(map.is_empty() && map.point_cloud(Selection::Static).is_empty());
    for depth in [0.0, f32::NAN, f32::INFINITY, -1.0, 0.1, 1e30] {
        map.insert(&frame(0.0, |_, _| depth), None, &Pose::identity()).unwrap();
    }
    assert_eq!(map.held_voxels(), 0);
    // A camera of one pixel, for which no frame has looked farther.
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let camera = PinholeCamera::new(1, 1, 1.0, 1.0, 0.0, 0.0).unwrap();
    let pixel = Frame::new(0.0, camera, DepthImage::new(1, 1, vec![1.0]).unwrap(), None).unwrap();
    map.insert(&pixel, None, &Pose::identity()).unwrap();
    // Held, but not yet believed.
    assert_eq!((map.held_voxels(), map.len()), (1, 0));
    map.insert(&pixel, None, &Pose::identity()).unwrap();
    assert_eq!((map.held_voxels(), map.len()), (1, 1));
}

/// The images of a frame, in grey.
fn without_color(frame: Frame) -> Frame {
    let timestamp = frame.timestamp();
    Frame::new(timestamp, camera(), frame.into_images().0, None).unwrap()
}

#[test]
fn a_frame_without_colour_leaves_the_colours_of_the_others() {
    let mut map = CloudMap::new(config(0.05), SensorModel::kinect()).unwrap();
    map.insert(&uneven(0), None, &pose(0)).unwrap();
    let colored = map.clone();
    let before: BTreeMap<_, _> = voxels(&map).iter().map(cell_and_color).collect();
    // The same places read again without colour, and others that only such a frame has read.
    let (again, elsewhere) = (without_color(uneven(0)), without_color(uneven(1)));
    map.insert(&again, None, &pose(0)).unwrap();
    map.insert(&elsewhere, None, &pose(1)).unwrap();
    assert_eq!(map.point_cloud(Selection::All).colors().map(<[Rgb]>::len), Some(map.held_voxels()));
    let after: BTreeMap<_, _> = voxels(&map).iter().map(cell_and_color).collect();
    assert!(before.iter().all(|(cell, color)| after[cell] == *color));
    assert!(after.iter().all(|(cell, color)| before.contains_key(cell) || color.is_none()));
    assert!(after.len() > before.len());
    map.remove(&again, None, &pose(0)).unwrap();
    map.remove(&elsewhere, None, &pose(1)).unwrap();
    assert_eq!(voxels(&map), voxels(&colored));
}

fn cell_and_color(voxel: &CloudVoxel) -> ([i64; 3], Option<Rgb>) {
    (voxel.position.map(|c| (f64::from(c) / 0.05).floor() as i64), voxel.color)
}

#[test]
fn a_cloud_without_a_coloured_frame_has_no_colours() {
    let mut map = CloudMap::new(config(0.05), SensorModel::kinect()).unwrap();
    map.insert(&without_color(uneven(0)), None, &pose(0)).unwrap();
    assert!(map.point_cloud(Selection::All).colors().is_none());
}

#[test]
fn configs_are_checked_field_by_field() {
    type Spoil = fn(&mut CloudMapConfig);
    let broken: [(&str, Spoil); 4] = [
        ("cloud.voxel_size", |config| config.voxel_size = 0.0),
        ("cloud.looks_per_reading", |config| config.looks_per_reading = 0.0),
        ("cloud.min_observations", |config| config.min_observations = 0),
        ("cloud.thinning_radius", |config| config.thinning_radius = -1.0),
    ];
    for (field, spoil) in broken {
        let mut config = CloudMapConfig::default();
        spoil(&mut config);
        match CloudMap::new(config, SensorModel::kinect()) {
            Err(Error::Config(error)) => assert_eq!(error.field, field),
            other => panic!("{field}: {other:?}"),
        }
    }
}

#[cfg(feature = "state")]
mod saved_state {
    use dymlm_core::SplitMix64;
    use dymlm_test_support::{SavedParts, damaged_parts, incomplete_parts, save_into, saved_parts};

    use super::*;

    fn load(parts: impl IntoIterator<Item = (u64, Vec<u8>)>) -> Result<CloudMap, Error> {
        CloudMap::load_state(config(0.01), SensorModel::kinect(), parts)
    }

    fn whole(map: &CloudMap) -> SavedParts {
        saved_parts(|sink| map.save_state(None, sink))
    }

    /// Everything that can be seen of a map.
    fn seen(map: &CloudMap) -> impl PartialEq + std::fmt::Debug + use<> {
        let ghosts: Vec<_> =
            map.verdicts().ghost_boxes_since(3).map(|corners| format!("{corners:?}")).collect();
        let ghosts: std::collections::BTreeSet<_> = ghosts.into_iter().collect();
        (
            voxels(map),
            map.point_cloud(Selection::Static),
            (map.frames(), map.held_voxels(), map.evidence_revision()),
            ghosts,
            map.history([0.0, 0.0, 3.3]),
            map.is_long_free([0.1, 0.0, 1.2], 0.0),
        )
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(cases(4)))]

        #[test]
        fn a_saved_map_goes_on_as_if_it_had_not_been(
            before in prop::collection::vec((0_u8..9, 0_usize..9), 0..10),
            after in prop::collection::vec((0_u8..9, 0_usize..9), 1..6),
        ) {
            let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
            let mut parts = whole(&map);
            for (step, seed) in before {
                let earlier = map.to_saved();
                apply(&mut map, step, seed);
                save_into(&mut parts, |sink| map.save_state(Some(&earlier), sink));
            }
            prop_assert!(parts == whole(&map), "what has changed, applied one after the other, is the whole");
            let mut loaded = load(parts.clone().into_iter().rev()).unwrap();
            prop_assert!(whole(&loaded) == parts);
            prop_assert_eq!(seen(&loaded), seen(&map));
            for (step, seed) in after {
                apply(&mut map, step, seed);
                apply(&mut loaded, step, seed);
                prop_assert_eq!(seen(&loaded), seen(&map));
            }
            prop_assert!(whole(&loaded) == whole(&map));
        }

        #[test]
        fn what_is_no_saved_map_is_refused_or_harmless(seed in any::<u64>()) {
            let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
            for seed in 0..5 {
                apply(&mut map, 5, seed);
            }
            let mut random = SplitMix64::new(seed);
            for _ in 0..10 {
                let parts = damaged_parts(&whole(&map), &mut random);
                if let Ok(mut damaged) = load(parts) {
                    apply(&mut damaged, 0, 2);
                    apply(&mut damaged, 5, 6);
                    apply(&mut damaged, 3, 1);
                    seen(&damaged);
                }
            }
        }
    }

    #[test]
    fn parts_that_are_missing_or_too_many_are_refused() {
        let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
        apply(&mut map, 5, 0);
        // Each part is left out once: what is left of the map is small.
        apply(&mut map, 4, 0);
        assert!(whole(&map).len() > 50);
        for (part, [without, twice]) in incomplete_parts(&whole(&map)) {
            assert!(matches!(load(without), Err(Error::State(_))), "without {part:#x}");
            assert!(matches!(load(twice), Err(Error::State(damaged)) if damaged.part == part));
        }
        assert!(matches!(load([]), Err(Error::State(_))));
    }

    #[test]
    fn what_is_known_of_a_saved_map_takes_little_memory() {
        let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
        (0..5).for_each(|seed| apply(&mut map, 5, seed));
        map.len();
        let (saved, whole) = (map.to_saved().memory_bytes(), map.memory_bytes());
        assert!(4 * saved < whole, "{saved} of {whole}");
    }

    #[test]
    fn an_unchanged_map_has_nothing_to_save() {
        let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
        assert_eq!(whole(&map).len(), 1);
        assert!(load(whole(&map)).unwrap().is_empty());
        apply(&mut map, 5, 0);
        assert!(saved_parts(|sink| map.save_state(Some(&map.to_saved()), sink)).is_empty());
    }
}

/// Regression: a block stayed of each place that had ever been seen.
#[test]
fn a_window_of_frames_takes_the_memory_of_what_it_holds() {
    let mut map = CloudMap::new(config(0.01), SensorModel::kinect()).unwrap();
    let view = |step: i32| {
        let camera = PinholeCamera::new(64, 48, 55.0, 55.0, 31.5, 23.5).unwrap();
        let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
        let pose = Pose::new([0.2 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        (Frame::new(0.5 * f64::from(step), camera, depth, None).unwrap(), pose)
    };
    let mut early = 0;
    for step in 0..200 {
        let (frame, pose) = view(step);
        map.insert(&frame, None, &pose).unwrap();
        if step >= 10 {
            let (frame, pose) = view(step - 10);
            map.remove(&frame, None, &pose).unwrap();
        }
        // Verdicts and static points are kept, too.
        std::hint::black_box(map.len());
        if step == 20 {
            early = map.memory_bytes();
        }
    }
    assert!(map.memory_bytes() < 2 * early, "{} after {early} bytes", map.memory_bytes());
    for step in 190..200 {
        let (frame, pose) = view(step);
        map.remove(&frame, None, &pose).unwrap();
    }
    assert!(map.memory_bytes() < early / 10, "{} after {early} bytes", map.memory_bytes());
}

//! Scans through the facade: OctoMap's leaves, somebody who walked by, frames beside scans, refused scans.

use crate::common::correct_counted;
use dymlm::cloud::{CloudMap, CloudVoxel, StaticPoints, Verdict};
use dymlm::core::{DepthImage, DepthNoise, Frame, FrameId, PinholeCamera, Point, Pose, SplitMix64};
use dymlm::octree::{CellState, Octree, RayMode};
use dymlm::{Detections, Error, FrameOutcome, HistoryConfig, MapBuilder, MapConfig, Selection};
use dymlm_test_support::{checksum, recording};

fn config() -> MapConfig {
    let mut config = MapConfig::default();
    (config.sensor.noise, config.sensor.max_depth) = (DepthNoise::constant(0.01), 20.0);
    config.cloud.voxel_size = 0.02;
    config
}

fn written(map: &Octree) -> Vec<u8> {
    let mut file = Vec::new();
    map.write_ot(&mut file).unwrap();
    file
}

/// A room of 6.04 x 4 x 3 m about the sensor, and whoever stands at x = 1.02 m.
fn room(seed: u64, with_visitor: bool) -> Vec<Point> {
    let mut random = SplitMix64::new(seed);
    let mut points = Vec::new();
    for _ in 0..30_000 {
        let direction = [(); 3].map(|()| 2.0 * random.fraction() - 1.0);
        let walls = [3.02, 2.0, 1.5].into_iter().zip(direction).map(|(half, c)| half / c.abs());
        let mut range = walls.fold(f64::INFINITY, f64::min);
        let [x, y, z] = direction.map(|c| c / direction[0]);
        if with_visitor && direction[0] > 0.0 && y.abs() < 0.25 && z.abs() < 0.8 {
            range = 1.02 * x / direction[0];
        }
        points.push(direction.map(|c| (range * c) as f32));
    }
    points
}

/// `insertPointCloud(node, inf, false, true)` at 0.1 m, by OctoMap 1.9.7.
#[test]
fn the_octree_is_that_of_octomap() {
    let Some(path) = recording("octomap/spherical_scan.graph") else { return };
    let bytes = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let coordinate = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as f32;
    let points: Vec<Point> =
        (0..number(4)).map(|i| [0, 1, 2].map(|axis| coordinate(8 + 28 * i + 4 + 8 * axis))).collect();
    let mut config = config();
    (config.octree.resolution, config.octree.max_range) = (0.1, f64::INFINITY);
    config.octree.rays = RayMode::PerCell;
    let mut builder = MapBuilder::new(config).unwrap();
    let pose = Pose::new([1.0, 0.0, -0.5], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let report = builder.insert_scan(0.0, &points, &pose).unwrap();
    let counts = builder.map().octree().counts();
    assert_eq!((counts.nodes, counts.leaves, counts.occupied_leaves), (6387, 5002, 1521));
    assert_eq!(checksum(written(builder.map().octree())), 0x568b_5f29_5b93_4311);
    assert_eq!(report.scan().unwrap().cloud.readings, points.len());
}

#[test]
fn a_corridor_is_in_cloud_and_octree() {
    let Some(path) = recording("octomap/scan.dat") else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let numbers: Vec<f32> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let points: Vec<Point> = numbers.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut unfused_config = config();
    unfused_config.cloud.fuse_surfaces = false;
    let mut unfused = MapBuilder::new(unfused_config).unwrap();
    let mut plain = Octree::new(config().octree).unwrap();
    let far_enough: Vec<Point> =
        points.iter().copied().filter(|[x, y, z]| x * x + y * y + z * z >= 0.09).collect();
    let min_depth = config().sensor.min_depth;
    assert!((min_depth - 0.3).abs() < 1e-6, "{min_depth}");
    for second in 0..2 {
        builder.insert_scan(f64::from(second), &points, &Pose::identity()).unwrap();
        unfused.insert_scan(f64::from(second), &points, &Pose::identity()).unwrap();
        plain.insert_scan([0.0; 3], &far_enough).unwrap();
    }
    assert!(written(builder.map().octree()) == written(&plain));
    let cloud = unfused.map().cloud();
    assert!(cloud.len() > 55_000 && cloud.len() * 100 > 95 * cloud.held_voxels());
    // Fused, the cloud is one layer of points a surface. It lies within the noise of the readings, three
    // standard deviations of 1 cm, and each of them has a point of the layer as near.
    let fused = builder.map().cloud();
    let (readings, layer) = (cloud.static_points(), fused.static_points());
    let is_near = |points: &StaticPoints<'_>, p: &Point| points.nearest(p.map(f64::from), 0.03).is_some();
    let all_near = |asked: &CloudMap, points: &StaticPoints<'_>| {
        asked.point_cloud(Selection::Static).points().iter().all(|point| is_near(points, point))
    };
    assert!(all_near(fused, &readings) && all_near(cloud, &layer));
    // Thinning leaves what lies on a surface, so the layer may have more points than the cloud that is not fused.
    let held = cloud.held_voxels();
    assert!(fused.len() > 55_000 && fused.len() <= held, "{} of {held}", fused.len());
}

#[test]
fn somebody_who_walked_by_is_in_neither_map() {
    let mut builder = MapBuilder::new(config()).unwrap();
    for step in 0..8_u32 {
        let scan = room(step.into(), step == 1);
        let report = builder.insert_scan(0.5 * f64::from(step), &scan, &Pose::identity()).unwrap();
        assert!(report.update().is_none() && report.scan().is_some_and(|scan| scan.octree.hit_cells > 100));
    }
    let map = builder.into_map();
    let is_near =
        |point: &Point| (point[0] - 1.0).abs() < 0.1 && point[1].abs() < 0.3 && point[2].abs() < 0.9;
    let count = |selection| map.cloud().point_cloud(selection).points().iter().filter(|p| is_near(p)).count();
    assert!(count(Selection::All) > 300);
    assert_eq!(count(Selection::Static), 0);
    assert_eq!(map.octree().state([1.02, 0.02, 0.02]), CellState::Free);
    let wall = (0..400).map(|i| [3.02, -0.48 + 0.05 * f64::from(i % 20), -0.48 + 0.05 * f64::from(i / 20)]);
    let occupied = wall.filter(|&place| map.octree().state(place) == CellState::Occupied).count();
    assert!(occupied > 320, "{occupied} of 400");
    assert!(map.cloud().len() > 10_000);
}

#[test]
fn scans_come_between_frames() {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let frame = |time: f64| {
        let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
        Frame::new(time, camera, depth, None).unwrap()
    };
    let mut builder = MapBuilder::new(config()).unwrap();
    builder.insert(&frame(0.0), Detections::Pending, &Pose::identity()).unwrap();
    let scan = builder.insert_scan(0.1, &room(1, false), &Pose::identity()).unwrap();
    assert_eq!((scan.id, scan.released.len()), (FrameId::new(1), 0));
    assert!(matches!(scan.outcome, FrameOutcome::Scanned(_)));
    // The frame has waited long enough.
    let scan = builder.insert_scan(5.0, &room(2, false), &Pose::identity()).unwrap();
    assert_eq!(scan.released.iter().map(|report| report.id).collect::<Vec<_>>(), [FrameId::new(0)]);
    assert!(builder.insert(&frame(5.0), &[], &Pose::identity()).is_ok());
}

#[test]
fn refused_scans_change_nothing() {
    let mut builder = MapBuilder::new(config()).unwrap();
    builder.insert_scan(3.0, &room(1, false), &Pose::identity()).unwrap();
    let before = state(&builder);
    let scan = room(2, false);
    let far = Pose::new([1e7, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    for (time, pose) in [(f64::NAN, Pose::identity()), (f64::INFINITY, Pose::identity()), (4.0, far)] {
        assert!(matches!(builder.insert_scan(time, &scan, &pose), Err(Error::Cloud(_))), "{time}");
    }
    assert!(matches!(builder.insert_scan(2.9, &scan, &Pose::identity()), Err(Error::Dynamics(_))));
    assert!(state(&builder) == before);
    // No return of the laser, and the sensor itself.
    let nothing = [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [0.0; 3], [0.05, 0.0, 0.0]];
    let report = builder.insert_scan(3.0, &nothing, &Pose::identity()).unwrap();
    let update = report.scan().unwrap();
    assert_eq!((update.cloud.readings, update.octree.hit_cells), (0, 0));
    assert!(state(&builder) == before);
    // Beyond the octree's border the cloud goes on.
    let beyond = Pose::new([2000.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let report = builder.insert_scan(4.0, &scan, &beyond).unwrap();
    let update = report.scan().unwrap();
    assert_eq!((update.octree.outside, update.cloud.readings), (scan.len(), scan.len()));
}

/// Everything of cloud and octree, in bytes and voxels.
fn state(builder: &MapBuilder) -> (Vec<u8>, Vec<CloudVoxel>) {
    let map = builder.map();
    (written(map.octree()), map.cloud().voxels(Selection::All).collect())
}

fn with_history(history: HistoryConfig) -> MapBuilder {
    let mut config = config();
    config.history = history;
    MapBuilder::new(config).unwrap()
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn scans_follow_corrected_poses() {
    let pose = |step: u64, drift: f64| {
        let x = 0.1 * step as f64;
        Pose::new([x, drift * x, 0.0], [0.0, 0.0, (drift * x).sin(), (drift * x).cos()]).unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let mapped = |steps: &[u64], drift: f64| {
        let mut builder = with_history(HistoryConfig::Folder(folder.path().into()));
        for &step in steps {
            let scan = room(step, step == 1);
            builder.insert_scan(0.5 * step as f64, &scan, &pose(step, drift)).unwrap();
        }
        builder
    };
    let all: Vec<u64> = (0..6).collect();
    let mut builder = mapped(&all, 0.2);
    let right: Vec<(FrameId, Pose)> = all.iter().map(|&step| (FrameId::new(step), pose(step, 0.0))).collect();
    builder.correct_poses(&right).unwrap();
    assert!(state(&builder) == state(&mapped(&all, 0.0)));
    builder.remove(FrameId::new(1)).unwrap();
    assert!(state(&builder) == state(&mapped(&[0, 2, 3, 4, 5], 0.0)));
}

#[test]
fn scans_and_frames_follow_corrected_poses_together() {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let mut builder = with_history(HistoryConfig::Memory);
    for step in 0..12_u32 {
        let (time, pose) = (0.3 * f64::from(step), Pose::identity());
        if step % 2 == 0 {
            let depth = DepthImage::new(64, 48, vec![2.0 + 0.01 * step as f32; 64 * 48]).unwrap();
            builder.insert(&Frame::new(time, camera, depth, None).unwrap(), &[], &pose).unwrap();
        } else {
            builder.insert_scan(time, &room(step.into(), step == 3), &pose).unwrap();
        }
    }
    let first = state(&builder);
    let moved = Pose::new([0.5, 0.2, 0.0], [0.0, 0.0, 0.6, 0.8]).unwrap();
    let poses: Vec<(FrameId, Pose)> = builder.trajectory().map(|(id, _, pose)| (id, pose)).collect();
    assert_eq!(poses.len(), 12);
    builder.correct_poses(&[(FrameId::new(4), moved), (FrameId::new(5), moved)]).unwrap();
    assert!(state(&builder) != first);
    builder.correct_poses(&poses).unwrap();
    assert!(state(&builder) == first);
}

/// Scans once a half second, each 10 cm further, and the poses with the last ones moved.
fn scans_of_a_way(count: u64) -> (MapBuilder, impl Fn(u64) -> Vec<(FrameId, Pose)>) {
    let pose = |step: u64| Pose::new([0.1 * step as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let mut builder = with_history(HistoryConfig::Memory);
    for step in 0..count {
        builder.insert_scan(0.5 * step as f64, &room(step, false)[..3000], &pose(step)).unwrap();
    }
    let moved = Pose::new([0.0, 0.3, 0.0], [0.0, 0.0, 0.6, 0.8]).unwrap();
    (builder, move |first| {
        (0..count)
            .map(|step| (FrameId::new(step), if step < first { pose(step) } else { moved * pose(step) }))
            .collect()
    })
}

#[test]
fn a_correction_of_scans_is_watched_and_reported() {
    let (mut builder, moved_from) = scans_of_a_way(6);
    let before = state(&builder);
    let mut steps = Vec::new();
    let cancelled = builder.correct_poses_watched(&moved_from(0), &mut |progress| {
        steps.push((progress.done, progress.total));
        progress.done < 3
    });
    assert!(matches!(cancelled, Err(Error::Cancelled)), "{cancelled:?}");
    assert_eq!(steps, [(1, 6), (2, 6), (3, 6)]);
    assert!(state(&builder) == before);
    let report = builder.correct_poses(&moved_from(2)).unwrap();
    assert_eq!((report.key_frames, report.moved_key_frames), (6, 4));
    assert!(report.largest_motion > 20.0 * report.new_from_old.angle(&Pose::identity()));
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_correction_of_the_last_scans_maps_few_again_to_the_same_bits() {
    let (mut builder, moved_from) = scans_of_a_way(26);
    let mut total = 0;
    // From the first such correction on.
    for first in [20, 26, 20] {
        (_, total) = correct_counted(&mut builder, &moved_from(first));
    }
    assert!((6..=12).contains(&total), "{total} scans were mapped again");
    let (mut again, _) = scans_of_a_way(26);
    // From the beginning.
    again.correct_poses(&moved_from(0)).unwrap();
    again.correct_poses(&moved_from(20)).unwrap();
    assert!(state(&again) == state(&builder));
}

/// Regression: a lidar's rays that hit nothing counted as readings.
#[test]
fn points_that_are_not_finite_or_too_near_are_no_readings() {
    let near = 0.5 * config().sensor.min_depth;
    let none = [[f32::INFINITY; 3], [f32::NAN, 0.0, 2.0], [0.0, f32::NEG_INFINITY, 0.0], [near, 0.0, 0.0]];
    let all: Vec<Point> = room(1, false).into_iter().chain(none).collect();
    let mut builders = [(); 2].map(|()| MapBuilder::new(config()).unwrap());
    let reports = [&all[..all.len() - none.len()], &all].map(|points| {
        let report =
            builders[usize::from(points.len() == all.len())].insert_scan(0.0, points, &Pose::identity());
        let FrameOutcome::Scanned(update) = report.unwrap().outcome else { panic!("a scan") };
        (update.cloud.readings, update.octree.readings, update.octree.not_finite)
    });
    assert_eq!(reports[0], reports[1]);
    assert_eq!(written(builders[0].map().octree()), written(builders[1].map().octree()));
}

/// The middle of a cell of .05 m; as wide are the cells of the octree and of the evidence here.
fn middle([x, y, z]: [i32; 3], mirror: f32) -> Point {
    let [x, y, z] = [x, y, z].map(|c| ((f64::from(c) + 0.5) * 0.05) as f32);
    [x, mirror * y, z]
}

/// A thing before a wall, of which a part (`mirror` times y below .5 m) goes away.
fn thing_before_a_wall(is_whole: bool, mirror: f32) -> Vec<Point> {
    let (first, depth) = (if is_whole { 4 } else { 10 }, 80.5 * 0.05);
    let thing = (-4..4).flat_map(|z| (first..16).map(move |y| middle([40, y, z], mirror)));
    let wall = (-60..60).flat_map(|z| (-20..60).map(move |y| [y, z].map(|c| (f64::from(c) + 0.5) * 0.025)));
    let is_seen = |[y, z]: &[f64; 2]| {
        // In cells, where the ray passes the thing.
        let [y, z] = [y, z].map(|c| c * 40.5 / 80.5 / 0.05);
        z.abs() > 4.5 || y > 16.5 || y < f64::from(first) + if is_whole { -0.5 } else { 0.2 }
    };
    let wall = wall.filter(is_seen).map(|[y, z]| [depth as f32, mirror * y as f32, z as f32]);
    thing.chain(wall).collect()
}

/// Regression: of the octree's cells above or beside what stays, some were kept for what is beside them, and
/// which ones depended on the side.
#[test]
fn what_has_gone_beside_a_thing_that_stays_is_free_whichever_side_it_was_on() {
    for mirror in [1.0, -1.0] {
        let mut config = config();
        (config.cloud.voxel_size, config.octree.max_range) = (0.05, 20.0);
        assert_eq!(config.octree.resolution, 0.05);
        let mut builder = MapBuilder::new(config).unwrap();
        let mut gone = 0;
        for step in 0..20 {
            let points = thing_before_a_wall(step < 8, mirror);
            builder.insert_scan(f64::from(step), &points, &Pose::identity()).unwrap();
            let (verdicts, octree) = (builder.map().cloud().verdicts(), builder.map().octree());
            for cell in (-4..4).flat_map(|z| (4..10).map(move |y| [40, y, z])) {
                let place = middle(cell, mirror).map(f64::from);
                let is_ghost = verdicts.at(place) == Some(Verdict::Ghost);
                gone += usize::from(is_ghost);
                let is_kept = is_ghost && octree.state(place) == CellState::Occupied;
                assert!(!is_kept, "scan {step}, mirrored by {mirror}: {cell:?}");
            }
        }
        assert!(gone > 0);
    }
}

//! Occupancy octree: insertion of scans and depth frames, queries, ray casts, files.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SEED, kinect, room_depth};
use dymlm_core::{Frame, PointCloud, Pose, SensorModel};
use dymlm_octree::{Octree, OctreeConfig, UnknownCells};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn empty_map(resolution: f64) -> Octree {
    let mut config = OctreeConfig::default();
    config.resolution = resolution;
    Octree::new(config).unwrap_or_else(|error| unreachable!("{error}"))
}

/// The points of the room's depth frame, seen from the origin.
fn room_points() -> Vec<[f32; 3]> {
    let (camera, depth) = (kinect(), room_depth());
    let pixels = (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v)));
    pixels
        .filter(|&(u, v)| depth.at(u, v) > 0.0)
        .map(|(u, v)| camera.back_project([u as f64, v as f64], depth.at(u, v).into()).map(|c| c as f32))
        .collect()
}

fn mapped_room(resolution: f64) -> Octree {
    let mut map = empty_map(resolution);
    let _ = map.insert_scan([0.0; 3], &room_points());
    map
}

/// The steady state: the map and its buffers exist, and the frame was inserted before.
fn insertion(c: &mut Criterion) {
    let points = room_points();
    let Ok(frame) = Frame::new(0.0, kinect(), room_depth(), None) else { unreachable!("images of one size") };
    let sensor = SensorModel { min_depth: 0.0, max_depth: 100.0, ..SensorModel::kinect() };
    let mut group = c.benchmark_group("octree/insert_depth");
    group.throughput(Throughput::Elements(points.len() as u64));
    for resolution in [0.05, 0.02] {
        let mut map = mapped_room(resolution);
        group.bench_function(BenchmarkId::from_parameter(resolution), |b| {
            b.iter(|| map.insert_depth(&frame, &sensor, None, &Pose::identity()));
        });
    }
    group.finish();

    let mut group = c.benchmark_group("octree/insert_scan");
    group.throughput(Throughput::Elements(points.len() as u64));
    for resolution in [0.05, 0.02] {
        let mut map = mapped_room(resolution);
        group.bench_function(BenchmarkId::from_parameter(resolution), |b| {
            b.iter(|| map.insert_scan([0.0; 3], &points));
        });
    }
    group.finish();

    let cloud = PointCloud::new(points);
    let mut group = c.benchmark_group("octree/from_cloud");
    group.throughput(Throughput::Elements(cloud.len() as u64));
    group.bench_function("300k", |b| b.iter(|| Octree::from_cloud(&cloud, OctreeConfig::default())));
    group.finish();
}

fn queries(c: &mut Criterion) {
    const COUNT: usize = 10_000;
    let map = mapped_room(0.05);
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut uniform = |half: f64| -> [f64; 3] { std::array::from_fn(|_| rng.random_range(-half..half)) };
    let points: Vec<[f64; 3]> = (0..COUNT).map(|_| uniform(2.0)).collect();
    let directions: Vec<[f64; 3]> = (0..COUNT / 10)
        .map(|_| {
            let [x, y, _] = uniform(0.5);
            [x, y, 1.0]
        })
        .collect();

    let mut group = c.benchmark_group("octree/query");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.bench_function("10k", |b| {
        b.iter(|| {
            for &point in &points {
                black_box(map.state(point));
            }
        });
    });
    group.finish();

    let mut group = c.benchmark_group("octree/cast_ray");
    group.throughput(Throughput::Elements(directions.len() as u64));
    group.bench_function("1k", |b| {
        b.iter(|| {
            for &direction in &directions {
                black_box(map.cast_ray([0.0; 3], direction, 5.0, UnknownCells::Pass));
            }
        });
    });
    group.finish();

    let mut group = c.benchmark_group("octree/nearest_obstacle");
    group.throughput(Throughput::Elements(directions.len() as u64));
    group.bench_function("1k", |b| {
        b.iter(|| {
            for &point in &points[..directions.len()] {
                black_box(map.nearest_obstacle(point, 5.0));
            }
        });
    });
    group.finish();
}

fn files(c: &mut Criterion) {
    let map = mapped_room(0.05);
    let mut ot = Vec::new();
    let _ = map.write_ot(&mut ot);
    let leaves = map.counts().leaves as u64;

    let mut group = c.benchmark_group("octree/leaves");
    group.throughput(Throughput::Elements(leaves));
    group.bench_function("room", |b| b.iter(|| map.leaves().count()));
    group.finish();

    let mut group = c.benchmark_group("octree/ot");
    group.throughput(Throughput::Elements(leaves));
    group.bench_function("write", |b| b.iter(|| map.write_ot(Vec::with_capacity(ot.len()))));
    group.bench_function("read", |b| b.iter(|| Octree::read_ot(ot.as_slice(), OctreeConfig::default())));
    group.finish();

    let mut group = c.benchmark_group("octree/project");
    group.bench_function("room", |b| b.iter(|| map.project([0.0, -1.0, 0.0], -1.0, 1.0)));
    group.finish();
}

criterion_group!(benches, insertion, queries, files);
criterion_main!(benches);

//! DBSCAN, voxel grid, statistical outlier removal, searches of the nearest point, overlap of oriented boxes,
//! and assignment.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SEED, SIZES, blobs, kinect, room_depth};
use dymlm_core::{OrganizedCloud, Point, PointCloud, Pose};
use dymlm_geometry::{
    Assignment, Clusters, Dbscan, DbscanConfig, DbscanScratch, OrientedBox, PointTree,
    StatisticalOutlierConfig, StatisticalOutlierRemoval, VoxelGrid, VoxelGridConfig, VoxelGridScratch,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The points of a depth frame, about 290 thousand.
#[allow(clippy::unwrap_used, reason = "the image has the camera's size")]
fn frame() -> Vec<Point> {
    let mut cloud = OrganizedCloud::new();
    cloud.back_project(&kinect(), &room_depth()).unwrap();
    cloud.points().iter().copied().filter(|point| point[2] > 0.0).collect()
}

/// Blobs of each size, and a frame.
fn inputs() -> Vec<(String, Vec<Point>)> {
    let name =
        |n: usize| if n < 1_000_000 { format!("{}k", n / 1000) } else { format!("{}M", n / 1_000_000) };
    let blobs = SIZES.iter().map(|&n| (name(n), blobs(n)));
    blobs.chain([("frame".to_owned(), frame())]).collect()
}

#[allow(clippy::unwrap_used, reason = "the default config is in range")]
fn dbscan(criterion: &mut Criterion) {
    let dbscan = Dbscan::new(DbscanConfig::default()).unwrap();
    let mut group = criterion.benchmark_group("dymlm-geometry/dbscan");
    group.sample_size(10);
    for (name, points) in inputs() {
        let (mut scratch, mut clusters) = (DbscanScratch::default(), Clusters::default());
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name), &points, |bencher, points| {
            bencher.iter(|| dbscan.cluster_into(black_box(points), &mut scratch, &mut clusters));
        });
    }
}

#[allow(clippy::unwrap_used, reason = "the default config is in range")]
fn voxel_grid(criterion: &mut Criterion) {
    let grid = VoxelGrid::new(VoxelGridConfig::default()).unwrap();
    let mut group = criterion.benchmark_group("dymlm-geometry/voxel_grid");
    group.sample_size(20);
    for (name, points) in inputs() {
        let colors = points.iter().map(|point| point.map(|x| (x * 50.0) as u8)).collect();
        let plain = (name.clone(), PointCloud::new(points.clone()));
        let colored = (name + "_colored", PointCloud::with_colors(points, colors).unwrap());
        for (name, cloud) in [plain, colored] {
            let (mut scratch, mut downsampled) = (VoxelGridScratch::default(), PointCloud::default());
            group.throughput(Throughput::Elements(cloud.len() as u64));
            group.bench_with_input(BenchmarkId::from_parameter(name), &cloud, |bencher, cloud| {
                bencher.iter(|| grid.downsample_into(black_box(cloud), &mut scratch, &mut downsampled));
            });
        }
    }
}

#[allow(clippy::unwrap_used, reason = "the default config is in range")]
fn statistical_outlier_removal(criterion: &mut Criterion) {
    let removal = StatisticalOutlierRemoval::new(StatisticalOutlierConfig::default()).unwrap();
    let mut group = criterion.benchmark_group("dymlm-geometry/statistical_outlier_removal");
    group.sample_size(10);
    for (name, points) in inputs().into_iter().filter(|(_, points)| points.len() < 1_000_000) {
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(name), &points, |bencher, points| {
            bencher.iter(|| removal.apply(black_box(points)));
        });
    }
}

/// A tree of a frame's points, and the nearest of them for places beside them and anywhere in the room.
fn point_tree(criterion: &mut Criterion) {
    let (mut rng, points) = (ChaCha8Rng::seed_from_u64(SEED), frame());
    let mut group = criterion.benchmark_group("dymlm-geometry/point_tree");
    group.sample_size(20);
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("new", |bencher| bencher.iter(|| PointTree::new(black_box(&points))));
    let tree = PointTree::new(&points);
    let beside = points.iter().step_by(29).map(|point| point.map(|c| c + 0.01));
    let anywhere = (0..10_000).map(|_| [-2.0, -1.5, 0.0].map(|low: f32| rng.random_range(low..low + 4.0)));
    for (name, places) in
        [("nearest_beside", beside.collect::<Vec<Point>>()), ("nearest_anywhere", anywhere.collect())]
    {
        group.throughput(Throughput::Elements(places.len() as u64));
        group.bench_function(name, |bencher| {
            bencher.iter(|| places.iter().filter_map(|&place| tree.nearest(place)).count());
        });
    }
}

/// Boxes of 0.1 to 1 m with any orientation, within half a metre of each other.
#[allow(clippy::unwrap_used, reason = "lengths and quaternions in range")]
fn turned_boxes(count: usize) -> Vec<OrientedBox> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut triple =
        |low: f64, high: f64| -> [f64; 3] { std::array::from_fn(|_| rng.random_range(low..high)) };
    (0..count)
        .map(|_| {
            let (axis, place, lengths) = (triple(-0.5, 0.5), triple(-0.25, 0.25), triple(0.1, 1.0));
            let w = (1.0 - axis.iter().map(|c| c * c).sum::<f64>()).sqrt();
            let pose = Pose::new(place, [axis[0], axis[1], axis[2], w]).unwrap();
            OrientedBox::new(pose, lengths).unwrap()
        })
        .collect()
}

fn oriented_box_overlap(criterion: &mut Criterion) {
    let boxes = turned_boxes(100);
    let mut group = criterion.benchmark_group("dymlm-geometry/oriented_box_overlap");
    group.throughput(Throughput::Elements((boxes.len() * boxes.len()) as u64));
    group.bench_function("100x100", |bencher| {
        bencher.iter(|| {
            let boxes = black_box(&boxes);
            let of = |a: &OrientedBox| boxes.iter().map(|b| a.intersection_volume(b)).sum::<f64>();
            boxes.iter().map(of).sum::<f64>()
        });
    });
}

fn assignment(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-geometry/assignment");
    for n in [10, 100, 300, 1000] {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let weights: Vec<i64> = (0..n * n).map(|_| rng.random_range(0..1_000_000)).collect();
        let mut assignment = Assignment::default();
        group.bench_with_input(BenchmarkId::from_parameter(n), &weights, |bencher, weights| {
            bencher.iter(|| assignment.solve(n, n, |row, column| black_box(weights)[n * row + column]).len());
        });
    }
}

criterion_group!(
    benches,
    dbscan,
    voxel_grid,
    statistical_outlier_removal,
    point_tree,
    oriented_box_overlap,
    assignment
);
criterion_main!(benches);

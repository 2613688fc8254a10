//! DBSCAN, voxel grid and statistical outlier removal.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SIZES, blobs, kinect, room_depth};
use dymlm_core::{OrganizedCloud, Point, PointCloud};
use dymlm_geometry::{
    Clusters, Dbscan, DbscanConfig, DbscanScratch, StatisticalOutlierConfig, StatisticalOutlierRemoval,
    VoxelGrid, VoxelGridConfig, VoxelGridScratch,
};

/// The points of a depth frame: some 290 thousand.
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
        let (mut scratch, mut clusters) = (DbscanScratch::new(), Clusters::new());
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
            let (mut scratch, mut downsampled) = (VoxelGridScratch::new(), PointCloud::default());
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

criterion_group!(benches, dbscan, voxel_grid, statistical_outlier_removal);
criterion_main!(benches);

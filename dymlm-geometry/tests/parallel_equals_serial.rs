//! The same bits with and without the feature `parallel`: these tests are run with and without it, and must
//! give the checksums written here both times. Inputs are made of integers, so that no library of elementary
//! functions affects them.

#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_core::{Point, PointCloud};
use dymlm_geometry::{
    Dbscan, DbscanConfig, StatisticalOutlierConfig, StatisticalOutlierRemoval, VoxelGrid, VoxelGridConfig,
};
use dymlm_test_support::{checksum, whole_numbers};

fn bytes_of(points: &[Point]) -> impl Iterator<Item = u8> + '_ {
    points.iter().flatten().flat_map(|c| c.to_le_bytes())
}

/// 20000 points in clumps.
fn points() -> Vec<Point> {
    let mut numbers = whole_numbers();
    let mut next = || numbers.next().unwrap_or(0);
    (0..20_000)
        .map(|_| {
            let clump = (next() % 40) as f32;
            [clump * 0.3 + next() as f32 * 1e-4, next() as f32 * 2e-4, next() as f32 * 1e-4]
        })
        .collect()
}

#[test]
fn dbscan() {
    let clusters = Dbscan::new(DbscanConfig::default()).unwrap().cluster(&points());
    assert!(clusters.count() > 1);
    let labels =
        clusters.labels().iter().flat_map(|label| label.map_or(u32::MAX, |label| label).to_le_bytes());
    assert_eq!(checksum(labels), DBSCAN);
}

#[test]
fn voxel_grid() {
    let mut config = VoxelGridConfig::default();
    config.voxel_size = 0.02;
    let cloud = VoxelGrid::new(config).unwrap().downsample(&PointCloud::new(points()));
    assert_eq!(checksum(bytes_of(cloud.points())), VOXEL_GRID);
}

#[test]
fn statistical_outlier_removal() {
    let removal = StatisticalOutlierRemoval::new(StatisticalOutlierConfig::default()).unwrap();
    let report = removal.apply(&points());
    assert!(report.inliers.len() > 10_000);
    assert_eq!(checksum(report.inliers.iter().flat_map(|index| index.to_le_bytes())), OUTLIERS);
}

const DBSCAN: u64 = 785_505_067_816_263_314;
const VOXEL_GRID: u64 = 4_366_979_335_492_723_052;
const OUTLIERS: u64 = 17_109_755_038_464_632_074;

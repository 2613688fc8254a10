//! The voxel grid against a plain reference, and on degenerate clouds.
use std::collections::BTreeMap;

use dymlm_core::{Point, PointCloud, Rgb, SplitMix64};
use dymlm_geometry::{VoxelGrid, VoxelGridConfig, VoxelGridScratch};
use dymlm_test_support::cases;
use proptest::prelude::*;

fn voxel_grid(voxel_size: f64) -> VoxelGrid {
    let mut config = VoxelGridConfig::default();
    config.voxel_size = voxel_size;
    VoxelGrid::new(config).unwrap()
}

/// Sum of the points, sum of the colours, number of points.
type Sums = ([f64; 3], [u64; 3], u64);

/// The documented rules, with a sorted map.
fn reference(cloud: &PointCloud, voxel_size: f64) -> PointCloud {
    let mut voxels: BTreeMap<[i64; 3], Sums> = BTreeMap::new();
    for (index, point) in cloud.points().iter().enumerate().filter(|(_, p)| p.iter().all(|x| x.is_finite())) {
        let voxel = point.map(|x| (f64::from(x) * (1.0 / voxel_size)).floor() as i64);
        let (sum, colors, count) = voxels.entry(voxel).or_default();
        for axis in 0..3 {
            sum[axis] += f64::from(point[axis]);
            colors[axis] += cloud.colors().map_or(0, |colors| u64::from(colors[index][axis]));
        }
        *count += 1;
    }
    let points = voxels.values().map(|(sum, _, n)| sum.map(|sum| (sum / *n as f64) as f32)).collect();
    let color = |(_, sum, n): &Sums| -> Rgb { sum.map(|sum| (sum as f64 / *n as f64).round() as u8) };
    match cloud.colors() {
        None => PointCloud::new(points),
        Some(_) => PointCloud::with_colors(points, voxels.values().map(color).collect()).unwrap(),
    }
}

fn clouds() -> impl Strategy<Value = PointCloud> {
    let coordinate = prop_oneof![
        20 => -0.5..0.5_f32,
        5 => (-20..20_i8).prop_map(|i| 0.1 * f32::from(i)),
        1 => -1e4..1e4_f32,
        1 => prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(f32::NEG_INFINITY), Just(-0.0)],
    ];
    let colored = (prop::array::uniform3(coordinate), prop::array::uniform3(any::<u8>()));
    (prop::collection::vec(colored, 0..400), any::<bool>()).prop_map(|(points, with_colors)| {
        let (points, colors): (Vec<Point>, Vec<Rgb>) = points.into_iter().unzip();
        if with_colors { PointCloud::with_colors(points, colors).unwrap() } else { PointCloud::new(points) }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(30)))]

    /// Voxels of 10 cm are numbered in 32 bits, those of 1 mm may need 52, those of 0.1 mm more.
    #[test]
    fn equals_the_reference(cloud in clouds(), voxel_size in prop_oneof![Just(0.1), Just(0.25), Just(1e-3), Just(1e-4), 1e-3..0.5]) {
        prop_assert_eq!(voxel_grid(voxel_size).downsample(&cloud), reference(&cloud, voxel_size));
    }

    #[test]
    fn the_order_of_points_does_not_matter(cloud in clouds()) {
        let grid = voxel_grid(0.1);
        let reversed = PointCloud::new(cloud.points().iter().rev().copied().collect());
        let (forth, back) = (grid.downsample(&cloud), grid.downsample(&reversed));
        prop_assert_eq!(forth.len(), back.len());
        for (a, b) in forth.points().iter().flatten().zip(back.points().iter().flatten()) {
            // Sums that cancel keep the rounding of their summands.
            prop_assert!((a - b).abs() <= f32::EPSILON * a.abs() + 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn buffers_carry_nothing_over(first in clouds(), second in clouds()) {
        let grid = voxel_grid(0.2);
        let (mut scratch, mut downsampled) = (VoxelGridScratch::default(), PointCloud::default());
        for cloud in [&first, &second, &first] {
            grid.downsample_into(cloud, &mut scratch, &mut downsampled);
            prop_assert_eq!(&downsampled, &grid.downsample(cloud));
        }
    }
}

#[test]
fn degenerate_clouds_have_plain_answers() {
    let grid = voxel_grid(0.01);
    assert!(grid.downsample(&PointCloud::default()).is_empty());
    assert!(grid.downsample(&PointCloud::new(vec![[f32::NAN; 3], [0.0, f32::INFINITY, 0.0]])).is_empty());
    assert_eq!(grid.downsample(&PointCloud::new(vec![[0.1, 0.2, 0.3]; 7])).points(), [[0.1, 0.2, 0.3]]);
    let empty_with_colors = PointCloud::with_colors(Vec::new(), Vec::new()).unwrap();
    assert_eq!(grid.downsample(&empty_with_colors).colors(), Some(&[][..]));
}

/// As far away as f32 goes, distinct points keep distinct voxels.
#[test]
fn huge_coordinates_do_not_overflow() {
    let far: Vec<Point> = [f32::MIN, -1e30, -1e10, 0.0, 1e10, 1e10_f32.next_up(), 1e30, f32::MAX]
        .map(|x| [x, -x, 0.5 * x])
        .into();
    let downsampled = voxel_grid(1e-5).downsample(&PointCloud::new([&far[..], &far].concat()));
    assert_eq!(downsampled.points(), far);
}

#[test]
fn refuses_settings_out_of_range() {
    for voxel_size in [0.0, -1.0, f64::NAN, f64::INFINITY, 9e-6, 1.1e5] {
        let mut config = VoxelGridConfig::default();
        config.voxel_size = voxel_size;
        assert_eq!(VoxelGrid::new(config).unwrap_err().field, "voxel_grid.voxel_size");
    }
    voxel_grid(1e-5);
    voxel_grid(1e5);
}

/// So many that they are sorted instead of looked up.
#[test]
fn a_large_scattered_cloud_equals_the_reference() {
    let mut random = SplitMix64::new(9);
    let mut coordinate = || if random.below(1000) == 0 { f32::NAN } else { 2.0 * random.fraction() as f32 };
    let points: Vec<Point> = (0..600_000).map(|_| std::array::from_fn(|_| coordinate())).collect();
    let colors = (0..points.len()).map(|index| [index as u8, (index / 256) as u8, 7]).collect();
    let cloud = PointCloud::with_colors(points, colors).unwrap();
    let shorter = PointCloud::new(cloud.points()[..550_000].to_vec());
    let small = PointCloud::new(cloud.points()[..1000].to_vec());
    // All but one point lie in one of the parts that they are put into.
    let with_outlier = PointCloud::new([shorter.points(), &[[-900.0, -0.0, 0.0]]].concat());
    let (mut scratch, mut downsampled) = (VoxelGridScratch::default(), PointCloud::default());
    for cloud in [&cloud, &shorter, &small, &with_outlier, &cloud] {
        voxel_grid(0.01).downsample_into(cloud, &mut scratch, &mut downsampled);
        assert_eq!(downsampled, reference(cloud, 0.01));
    }
    // More cells than parts of records can tell apart.
    assert_eq!(voxel_grid(1e-4).downsample(&shorter), reference(&shorter, 1e-4));
}

//! Statistical outlier removal against brute force, against `Open3D`, and on degenerate clouds.
use crate::common::{data, golden_points};
use dymlm_core::Point;
use dymlm_geometry::{StatisticalOutlierConfig, StatisticalOutlierRemoval};
use dymlm_test_support::cases;
use proptest::prelude::*;

fn removal(neighbors: usize, std_ratio: f64) -> StatisticalOutlierRemoval {
    let mut config = StatisticalOutlierConfig::default();
    (config.neighbors, config.std_ratio) = (neighbors, std_ratio);
    StatisticalOutlierRemoval::new(config).unwrap()
}

/// Mean distance of each point to its nearest others, by sorting all distances.
fn mean_distances(points: &[Point], neighbors: usize) -> Vec<f64> {
    let distance = |a: &Point, b: &Point| {
        (0..3).map(|axis| (f64::from(a[axis]) - f64::from(b[axis])).powi(2)).sum::<f64>().sqrt()
    };
    (0..points.len())
        .map(|a| {
            let others = (0..points.len()).filter(|&b| b != a);
            let mut distances: Vec<f64> = others.map(|b| distance(&points[a], &points[b])).collect();
            distances.sort_by(f64::total_cmp);
            distances.truncate(neighbors);
            distances.iter().sum::<f64>() / distances.len().max(1) as f64
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(50)))]

    #[test]
    fn equals_brute_force(
        points in prop::collection::vec(prop_oneof![
            4 => prop::array::uniform3(-0.5..0.5_f32),
            2 => prop::array::uniform3(0..4_i8).prop_map(|cell| cell.map(|i| 0.25 * f32::from(i))),
            1 => prop::array::uniform3(-3.0..3.0_f32),
        ], 2..200),
        neighbors in 1..30_usize,
        std_ratio in 0.0..3.0_f64,
    ) {
        let report = removal(neighbors, std_ratio).apply(&points);
        let distances = mean_distances(&points, neighbors);
        let mean = distances.iter().sum::<f64>() / points.len() as f64;
        let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (points.len() - 1) as f64;
        let threshold = mean + std_ratio * variance.sqrt();
        prop_assert!((report.mean_distance - mean).abs() < 1e-6);
        prop_assert!((report.std_distance - variance.sqrt()).abs() < 1e-6);
        prop_assert!((report.threshold - threshold).abs() < 1e-5);
        prop_assert!(report.inliers.is_sorted());
        for (index, distance) in distances.iter().enumerate() {
            // On the threshold itself the last bits decide.
            if (distance - threshold).abs() > 1e-5 {
                prop_assert_eq!(report.inliers.contains(&index), *distance < threshold);
            }
        }
    }

    #[test]
    fn skips_points_that_are_not_finite(
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), 1..100),
        holes in prop::collection::vec((0..120_usize, 0..3_usize, 0..4_usize), 1..20),
    ) {
        let mut all = points;
        for (place, axis, kind) in holes {
            let mut hole = [0.25; 3];
            hole[axis] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX][kind];
            all.insert(place.min(all.len()), hole);
        }
        let good: Vec<usize> = (0..all.len()).filter(|&i| all[i].iter().all(|x| x.abs() < 2.0)).collect();
        let alone: Vec<Point> = good.iter().map(|&i| all[i]).collect();
        let (mut expected, report) = (removal(8, 1.0).apply(&alone), removal(8, 1.0).apply(&all));
        expected.inliers.iter_mut().for_each(|index| *index = good[*index]);
        prop_assert_eq!(report, expected);
    }
}

/// `tests/data/make_golden.py` made the points and `Open3D`'s inliers. `Open3D` counts the point itself among
/// its neighbours, at distance 0, which scales all mean distances alike and changes no verdict.
#[test]
fn equals_open3d() {
    let points = golden_points();
    let golden = data("outliers.csv");
    assert_eq!(golden.lines().count(), 3);
    for line in golden.lines() {
        let mut fields = line.split(',');
        let nb_neighbors: usize = fields.next().unwrap().parse().unwrap();
        let std_ratio = fields.next().unwrap().parse().unwrap();
        let expected: Vec<usize> = fields.map(|index| index.parse().unwrap()).collect();
        assert_eq!(
            removal(nb_neighbors - 1, std_ratio).apply(&points).inliers,
            expected,
            "{nb_neighbors} {std_ratio}"
        );
    }
}

#[test]
fn degenerate_clouds_have_plain_answers() {
    let removal = removal(20, 2.0);
    let none = removal.apply(&[]);
    assert!(none.inliers.is_empty());
    assert_eq!([none.mean_distance, none.std_distance, none.threshold], [0.0; 3]);
    assert!(removal.apply(&[[f32::NAN; 3]]).inliers.is_empty());
    assert_eq!(removal.apply(&[[1.0; 3]]).inliers, [0]);
    assert_eq!(removal.apply(&[[0.0; 3], [1.0, 0.0, 0.0]]).mean_distance, 1.0);
    // Duplicates, and points of a plane along the axes.
    assert_eq!(removal.apply(&[[1.0, 2.0, 3.0]; 500]).inliers.len(), 500);
    let plane: Vec<Point> =
        (0..2500).map(|i| [0.01 * (i % 50) as f32, 0.01 * (i / 50) as f32, 1.0]).collect();
    let report = removal.apply(&plane);
    // The number that Open3D's remove_statistical_outlier(21, 2.0) keeps: the rim has its neighbours on one
    // side only.
    assert_eq!(report.inliers.len(), 2304);
    assert!((report.mean_distance - 0.02).abs() < 0.005, "{report:?}");
}

#[test]
fn refuses_settings_out_of_range() {
    let refused = |neighbors: usize, std_ratio: f64| {
        let mut config = StatisticalOutlierConfig::default();
        (config.neighbors, config.std_ratio) = (neighbors, std_ratio);
        StatisticalOutlierRemoval::new(config).unwrap_err().field
    };
    assert_eq!([refused(0, 2.0), refused(1001, 2.0)], ["statistical_outlier.neighbors"; 2]);
    for std_ratio in [-0.1, f64::NAN, 101.0] {
        assert_eq!(refused(20, std_ratio), "statistical_outlier.std_ratio");
    }
}

use dymlm_core::{ConfigError, Point, check_range};

use crate::box_tree::{BoxTree, Nearest};
use crate::parallel::{for_each, task_size};

/// Which points stand apart.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct StatisticalOutlierConfig {
    /// Number of nearest neighbours, the point itself not counted, as in PCL (`Open3D` counts it: its
    /// `nb_neighbors` is one more); 1 to 1000. Default 20, as in `Open3D`'s documentation.
    pub neighbors: usize,
    /// How many standard deviations above the mean a point's distance may be; 0 to 100. Default 2, as in
    /// `Open3D`'s documentation; smaller removes more.
    pub std_ratio: f64,
}

impl Default for StatisticalOutlierConfig {
    fn default() -> Self {
        Self { neighbors: 20, std_ratio: 2.0 }
    }
}

/// Removal of points that stand apart from the others.
///
/// For each point the mean distance to its nearest neighbours is taken; a point whose distance exceeds the
/// mean of these distances over the cloud by more than [`std_ratio`](StatisticalOutlierConfig::std_ratio)
/// standard deviations (of the sample: n - 1) is an outlier. So is a point that is not finite, or so far from
/// the origin (some 9e18 m) that squared distances would leave the range of f32. In a cloud of fewer points
/// than neighbours, all others are the neighbours; a point alone is an inlier, at distance 0.
///
/// O(n log n), with a tree of tight boxes, on equal points and on points in planes too. The same bits come
/// out with feature `parallel`, on any number of threads.
///
/// Rusu, Marton, Blodow, Dolha, Beetz: "Towards 3D point cloud based object maps for household environments",
/// Robotics and Autonomous Systems 2008; PCL's `StatisticalOutlierRemoval`.
///
/// ```
/// use dymlm_geometry::{StatisticalOutlierConfig, StatisticalOutlierRemoval};
///
/// let mut points: Vec<[f32; 3]> = (0..100).map(|i| [0.01 * (i % 10) as f32, 0.01 * (i / 10) as f32, 1.0]).collect();
/// points[7][2] = 0.5;
///
/// let report = StatisticalOutlierRemoval::new(StatisticalOutlierConfig::default())?.apply(&points);
/// assert_eq!(report.inliers.len(), 99);
/// assert!(!report.inliers.contains(&7));
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StatisticalOutlierRemoval {
    config: StatisticalOutlierConfig,
}

/// What [`StatisticalOutlierRemoval`] found.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct StatisticalOutlierReport {
    /// Indices of the points to keep, ascending; for [`PointCloud::select`](dymlm_core::PointCloud::select).
    pub inliers: Vec<usize>,
    /// Mean over the points of their mean distances to their neighbours, metres; 0 without a finite point.
    pub mean_distance: f64,
    /// Standard deviation of these distances, metres; 0 for fewer than two points.
    pub std_distance: f64,
    /// Largest distance of an inlier, inclusive: `mean_distance` + `std_ratio` * `std_distance`, metres.
    pub threshold: f64,
}

impl StatisticalOutlierRemoval {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its documented range.
    pub fn new(config: StatisticalOutlierConfig) -> Result<Self, ConfigError> {
        check_range("statistical_outlier.neighbors", config.neighbors as f64, 1.0..=1000.0)?;
        check_range("statistical_outlier.std_ratio", config.std_ratio, 0.0..=100.0)?;
        Ok(Self { config })
    }

    /// Finds the points to keep.
    pub fn apply(&self, points: &[Point]) -> StatisticalOutlierReport {
        let candidates: Vec<usize> = (0..points.len()).filter(|&index| is_near(&points[index])).collect();
        let positions: Vec<Point> = candidates.iter().map(|&index| points[index]).collect();
        let distances = mean_neighbor_distances(&positions, self.config.neighbors);
        let (mean_distance, std_distance) = mean_and_std(&distances);
        let threshold = mean_distance + self.config.std_ratio * std_distance;
        let inliers = candidates.iter().zip(&distances).filter(|(_, distance)| **distance <= threshold);
        StatisticalOutlierReport {
            inliers: inliers.map(|(&index, _)| index).collect(),
            mean_distance,
            std_distance,
            threshold,
        }
    }
}

fn is_near(point: &Point) -> bool {
    // Two such points are at most as far apart as the outer one is from its mirror image at the origin.
    point.iter().map(|x| (2.0 * x) * (2.0 * x)).sum::<f32>().is_finite()
}

/// For each point the mean distance to its `neighbors` nearest other points, metres.
fn mean_neighbor_distances(points: &[Point], neighbors: usize) -> Vec<f64> {
    let tree = BoxTree::new(points.iter().copied());
    let mut in_order = vec![0.0; tree.points().len()];
    let share = task_size(in_order.len());
    for_each(in_order.chunks_mut(share).zip(tree.points().chunks(share)), |(distances, points)| {
        // The nearest point is the point itself, or one that equals it: at distance 0 in either case.
        let mut nearest = Nearest::new(neighbors + 1);
        for (distance, point) in distances.iter_mut().zip(points) {
            let nearest = nearest.find(&tree, *point);
            let others = nearest.iter().skip(1).map(|&squared| f64::from(squared).sqrt());
            *distance = others.sum::<f64>() / nearest.len().saturating_sub(1).max(1) as f64;
        }
    });
    let mut distances = vec![0.0; points.len()];
    for (&index, distance) in tree.indices().iter().zip(in_order) {
        distances[index as usize] = distance;
    }
    distances
}

/// Mean and standard deviation of a sample.
fn mean_and_std(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count.max(1.0);
    let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    (mean, (squares / (count - 1.0).max(1.0)).sqrt())
}

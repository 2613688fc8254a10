//! Density-based clustering: [`Dbscan`].

mod border_points;
mod clusters;
mod config;
mod connected_cells;
mod core_points;
mod grid;
mod large_counts;
mod rows;
mod run;
mod touching_blocks;
mod union_find;

pub use clusters::Clusters;
pub use config::DbscanConfig;

use dymlm_core::{ConfigError, Point};

use border_points::BorderPoints;
use clusters::NO_CLUSTER;
use connected_cells::ConnectedCells;
use core_points::count_neighbors;
use grid::Grid;

/// Exact DBSCAN in 3D.
///
/// A point with at least [`min_points`](DbscanConfig::min_points) points within [`eps`](DbscanConfig::eps),
/// itself counted, is a core point. Core points within eps of each other belong to one cluster, and so on
/// transitively. A point that is no core point belongs to the first cluster, by number, that has a core point
/// within eps of it: a border point. What is left is noise, and so is every point that is not finite.
/// Clusters are numbered in the order of their first core points in the cloud. These are scikit-learn's
/// rules, and its labels.
///
/// Two points are within eps when `dx * dx + dy * dy + dz * dz <= eps * eps`, evaluated in f32 in this order.
/// Points after the first 2^32 - 1 are noise.
///
/// # Algorithm
///
/// Points are sorted into cubic cells with a diagonal of eps, so that all points of a cell are neighbours: a
/// cell of `min_points` points or more has core points only, and the core points of a cell belong to one
/// cluster. What is left is to count neighbours in sparse cells, and to join cells by a union-find, looking
/// for one near pair among the two cells' core points and only while the cells are not joined yet. The grid
/// is a sorted list of blocks of eight cells, walked along its rows: no hash table, and memory of O(n) for
/// any extent.
///
/// Time is O(`min_points` n), less where cells are full. When `min_points` is above some hundred, and for
/// pairs of crowded cells that just fail to touch, boxes of points are compared instead of points: O(n log n)
/// on points that are equal, within eps of each other or hopelessly few, and less than O(n^2) on any (no
/// algorithm with less than n^(4/3) is known in 3D: Gan, Tao: "DBSCAN revisited: mis-claim, un-fixability,
/// and approximation", SIGMOD 2015). The same bits come out with feature `parallel`, on any number of
/// threads.
///
/// Ester, Kriegel, Sander, Xu: "A density-based algorithm for discovering clusters in large spatial databases
/// with noise", KDD 1996. Grid: Gunawan: "A faster algorithm for DBSCAN", TU Eindhoven 2013; de Berg,
/// Gunawan, Roeloffzen: "Faster DBSCAN and HDBSCAN in low-dimensional Euclidean spaces", IJCGA 2019.
///
/// ```
/// use dymlm_geometry::{Dbscan, DbscanConfig};
///
/// let mut config = DbscanConfig::default();
/// config.eps = 0.15;
/// config.min_points = 3;
/// let points = [[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [5.0, 0.0, 1.0], [0.2, 0.0, 1.0], [0.1, f32::NAN, 1.0]];
///
/// let clusters = Dbscan::new(config)?.cluster(&points);
/// assert_eq!(clusters.labels(), [Some(0), Some(0), None, Some(0), None]);
/// assert_eq!(clusters.sizes(), [3]);
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dbscan {
    config: DbscanConfig,
}

/// Working memory of [`Dbscan::cluster_into`]; kept between calls, it saves all allocation.
#[derive(Debug, Default)]
pub struct DbscanScratch {
    grid: Grid,
    /// Neighbours of each slot of the grid, counted up to `min_points`.
    neighbors: Vec<u32>,
    connected: ConnectedCells,
    border: BorderPoints,
    numbering: Numbering,
}

/// A clone begins without buffers: their content does not matter between calls.
impl Clone for DbscanScratch {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// How cells are given the numbers of their clusters.
#[derive(Debug, Default)]
struct Numbering {
    /// First core point and representative cell of each cluster, sorted.
    clusters: Vec<(u32, u32)>,
    /// The number of each cell's cluster.
    label_of_cell: Vec<u32>,
}

impl Dbscan {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its documented range.
    pub fn new(config: DbscanConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self { config })
    }

    /// Clusters a cloud.
    pub fn cluster(&self, points: &[Point]) -> Clusters {
        let mut clusters = Clusters::default();
        self.cluster_into(points, &mut DbscanScratch::default(), &mut clusters);
        clusters
    }

    /// Clusters a cloud into a caller's buffers, whose content does not matter. Allocates nothing once the
    /// buffers have grown to the size of the clouds, except for boxes around crowded cells (and, with feature
    /// `parallel`, for lists of tasks).
    pub fn cluster_into(&self, points: &[Point], scratch: &mut DbscanScratch, clusters: &mut Clusters) {
        let DbscanScratch { grid, neighbors, connected, border, numbering } = scratch;
        let squared_eps = self.config.eps * self.config.eps;
        let min_points = self.config.min_points as u32;

        grid.build(self.config.eps, points);
        count_neighbors(grid, squared_eps, min_points, neighbors);
        border.take_from(grid, neighbors, min_points);
        connected.join(grid, squared_eps);
        numbering.number(grid, connected);
        border.label(grid, &numbering.label_of_cell, squared_eps, points, min_points);
        write_labels(grid, numbering, border, points.len(), clusters);
    }
}

impl Numbering {
    /// Numbers the clusters by their first core points.
    fn number(&mut self, grid: &Grid, connected: &ConnectedCells) {
        // A cell's points ascend, so a cluster's first core point is the first point of one of its cells.
        let first_points = &mut self.label_of_cell;
        first_points.clear();
        first_points.resize(grid.cell_count(), NO_CLUSTER);
        for cell in 0..grid.cell_count() {
            let first = &mut first_points[connected.root(cell)];
            *first = grid.point_indices(cell).first().map_or(*first, |&point| point.min(*first));
        }
        self.clusters.clear();
        let roots = (0..).zip(first_points.iter()).filter(|(_, first)| **first != NO_CLUSTER);
        self.clusters.extend(roots.map(|(cell, first)| (*first, cell)));
        self.clusters.sort_unstable();
        for (label, &(_, root)) in (0..).zip(&self.clusters) {
            self.label_of_cell[root as usize] = label;
        }
        for cell in 0..grid.cell_count() {
            self.label_of_cell[cell] = self.label_of_cell[connected.root(cell)];
        }
    }
}

/// Writes the labels of the cloud from those of cells and border points.
fn write_labels(
    grid: &Grid,
    numbering: &Numbering,
    border: &BorderPoints,
    point_count: usize,
    clusters: &mut Clusters,
) {
    let Clusters { labels, sizes } = clusters;
    labels.clear();
    labels.resize(point_count, None);
    sizes.clear();
    sizes.resize(numbering.clusters.len(), 0);
    for (cell, &label) in numbering.label_of_cell.iter().enumerate() {
        let points = grid.point_indices(cell);
        sizes[label as usize] += points.len();
        for &point in points {
            labels[point as usize] = Some(label);
        }
    }
    for (point, label) in border.labels() {
        labels[point] = Some(label);
        sizes[label as usize] += 1;
    }
}

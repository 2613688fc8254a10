//! Density-based clustering.

mod clusters;
mod config;

pub use clusters::Clusters;
pub use config::DbscanConfig;

use dymlm_core::{ConfigError, Point};

/// Exact DBSCAN in 3D.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dbscan {
    config: DbscanConfig,
}

/// Working memory of [`Dbscan::cluster_into`]; kept between calls, it saves all allocation.
#[derive(Debug, Clone, Default)]
pub struct DbscanScratch {
    core: Vec<bool>,
    open: Vec<usize>,
}

impl DbscanScratch {
    /// Empty working memory.
    pub fn new() -> Self {
        Self::default()
    }
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
        let mut clusters = Clusters::new();
        self.cluster_into(points, &mut DbscanScratch::new(), &mut clusters);
        clusters
    }

    /// Clusters a cloud into a caller's buffers.
    pub fn cluster_into(&self, points: &[Point], scratch: &mut DbscanScratch, clusters: &mut Clusters) {
        // First version, by the definition; the grid takes its place.
        let squared = self.config.eps * self.config.eps;
        let near = |a: usize, b: usize| {
            let [dx, dy, dz]: [f32; 3] = std::array::from_fn(|k| points[a][k] - points[b][k]);
            dx * dx + dy * dy + dz * dz <= squared
        };
        let n = points.len();
        scratch.core.clear();
        scratch.core.extend((0..n).map(|a| (0..n).filter(|&b| near(a, b)).count() >= self.config.min_points));
        clusters.labels.clear();
        clusters.labels.resize(n, None);
        clusters.sizes.clear();
        for first in 0..n {
            if !scratch.core[first] || clusters.labels[first].is_some() {
                continue;
            }
            let label = clusters.sizes.len() as u32;
            clusters.labels[first] = Some(label);
            clusters.sizes.push(1);
            scratch.open.push(first);
            while let Some(a) = scratch.open.pop() {
                for b in 0..n {
                    if clusters.labels[b].is_none() && near(a, b) {
                        clusters.labels[b] = Some(label);
                        clusters.sizes[label as usize] += 1;
                        if scratch.core[b] {
                            scratch.open.push(b);
                        }
                    }
                }
            }
        }
    }
}

//! Isolation forests: [`IsolationForest`].

mod config;
mod grow;
mod path_length;
mod trees;

pub use config::IsolationForestConfig;
pub use grow::IsolationForestScratch;
pub use trees::IsolationTrees;

use dymlm_core::ConfigError;

use grow::grow;

/// Finds rows that stand apart: those that random cuts separate from all others after few steps.
///
/// Each tree is grown on [`sample_size`](IsolationForestConfig::sample_size) rows drawn without replacement.
/// A node cuts along a column chosen at random among those in which its rows differ, at a value drawn
/// uniformly between their least and greatest, until each row is alone, all rows are equal or the tree is as
/// high as a balanced one, ceil(log2 of the sample). A row's score is 2^(-E/c): E is the mean over the trees
/// of the steps to its leaf, plus c(m) for a leaf that holds m rows of the sample, and c(n) the mean path of
/// n rows. Scores near 1 are outliers, well below 0.5 ordinary rows.
///
/// A row is an array of `D` numbers: a [`Point`](dymlm_core::Point), or any features; flat row-major data is
/// split by `as_chunks`. Rows that are not finite are not drawn, and score 1. Without a second row that
/// differs nothing stands apart: all finite rows score 0.5.
///
/// Growing takes O(trees * sample * log sample), scoring O(n * trees * log sample) at most. The same seed
/// gives the same trees on every machine.
///
/// Liu, Ting, Zhou: "Isolation Forest", ICDM 2008; "Isolation-Based Anomaly Detection", ACM TKDD 6, 2012.
///
/// ```
/// use dymlm_geometry::{IsolationForest, IsolationForestConfig};
///
/// let mut points: Vec<[f32; 3]> = (0..400).map(|i| [0.01 * (i % 20) as f32, 0.01 * (i / 20) as f32, 1.0]).collect();
/// points[7] = [0.1, 0.1, 0.5];
///
/// let forest = IsolationForest::new(IsolationForestConfig::default())?;
/// let scores = forest.fit(&points).scores(&points);
/// assert!(scores[7] > 0.6 && scores[7] > 1.3 * scores[30], "{}", scores[7]);
/// assert!(!forest.inliers(&points).contains(&7));
/// # Ok::<(), dymlm_core::ConfigError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IsolationForest {
    config: IsolationForestConfig,
}

impl IsolationForest {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when a field is outside its documented range.
    pub fn new(config: IsolationForestConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        Ok(Self { config })
    }

    /// Grows the trees.
    pub fn fit<const D: usize>(&self, rows: &[[f32; D]]) -> IsolationTrees<D> {
        let mut trees = IsolationTrees::default();
        self.fit_into(rows, &mut IsolationForestScratch::default(), &mut trees);
        trees
    }

    /// Grows the trees in a caller's buffers, whose content does not matter. Allocates nothing once they have
    /// grown.
    pub fn fit_into<const D: usize>(
        &self,
        rows: &[[f32; D]],
        scratch: &mut IsolationForestScratch<D>,
        trees: &mut IsolationTrees<D>,
    ) {
        grow(&self.config, rows, scratch, trees);
    }

    /// Indices of the rows that score at most the [`threshold`](IsolationForestConfig::threshold) in trees
    /// grown on them all, ascending.
    pub fn inliers<const D: usize>(&self, rows: &[[f32; D]]) -> Vec<usize> {
        let scores = self.fit(rows).scores(rows);
        (0..rows.len()).filter(|&row| scores[row] <= self.config.threshold).collect()
    }
}

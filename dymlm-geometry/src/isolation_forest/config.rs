use dymlm_core::{ConfigError, check_range};

/// How many trees, grown on how many rows, and what is an outlier.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct IsolationForestConfig {
    /// Number of trees; 1 to 10000. Default 100, where path lengths have settled (Liu 2008, section 4.1).
    pub trees: usize,
    /// Rows drawn for each tree, without replacement; 2 to 65536. Default 256 (Liu 2008, section 4.1, and the
    /// paper's psn).
    pub sample_size: usize,
    /// Score above which a row is an outlier, 0 to 1. Default 0.6 (Liu 2008, section 2, and the paper).
    pub threshold: f64,
    /// Seed of all random choices. Default 0.
    pub seed: u64,
}

impl Default for IsolationForestConfig {
    fn default() -> Self {
        Self { trees: 100, sample_size: 256, threshold: 0.6, seed: 0 }
    }
}

impl IsolationForestConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("isolation_forest.trees", self.trees as f64, 1.0..=1e4)?;
        check_range("isolation_forest.sample_size", self.sample_size as f64, 2.0..=65536.0)?;
        check_range("isolation_forest.threshold", self.threshold, 0.0..=1.0)
    }
}

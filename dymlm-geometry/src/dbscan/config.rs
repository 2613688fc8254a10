use dymlm_core::{ConfigError, check_range};

/// What a cluster is: how near and how many.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct DbscanConfig {
    /// Largest distance between neighbours, metres, inclusive; 1e-6 to 1e6. Default 0.05: some ten pixels of
    /// a 640x480 depth image at 2 m, and less than the usual gap between two things in a room.
    pub eps: f32,
    /// Neighbours that make a core point, the point itself counted (scikit-learn's `min_samples`); 1 to 1e9.
    /// Default 10: enough that the sparse stray pixels along depth edges do not bridge two surfaces.
    pub min_points: usize,
}

impl Default for DbscanConfig {
    fn default() -> Self {
        Self { eps: 0.05, min_points: 10 }
    }
}

impl DbscanConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        let (min, max) = (f64::from(1e-6_f32), 1e6);
        check_range("dbscan.eps", self.eps.into(), min..=max)?;
        check_range("dbscan.min_points", self.min_points as f64, 1.0..=1e9)
    }
}

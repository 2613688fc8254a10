use dymlm_core::{ConfigError, check_range};

/// When [`PoseGraph::optimize`](crate::PoseGraph::optimize) ends.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SolverConfig {
    /// Most steps of Levenberg-Marquardt, those that were taken back included, in each round that decides
    /// which factors are wrong: 1 to 10,000.
    pub max_iterations: usize,
    /// A step that lowers the cost by a smaller share of the cost is the last: 0 to 1.
    pub relative_decrease: f64,
    /// Largest squared error of a loop closure that is right, in standard deviations, 1 to 1e9. Default
    /// 22.46: 99.9 % of the right ones, by the chi-squared distribution of six degrees of freedom.
    pub max_closure_error: f64,
    /// Largest squared error of a view of a plane or a landmark that is right, in standard deviations, 1 to
    /// 1e9. Default 16.27: 99.9 % of the right ones, by the chi-squared distribution of three degrees of
    /// freedom: a distance and two tilts, or a place.
    pub max_view_error: f64,
}

impl Default for SolverConfig {
    fn default() -> Self {
        Self { max_iterations: 100, relative_decrease: 1e-6, max_closure_error: 22.46, max_view_error: 16.27 }
    }
}

impl SolverConfig {
    /// # Errors
    ///
    /// The first field that is outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        check_range("solver.max_iterations", self.max_iterations as f64, 1.0..=1e4)?;
        check_range("solver.relative_decrease", self.relative_decrease, 0.0..=1.0)?;
        check_range("solver.max_closure_error", self.max_closure_error, 1.0..=1e9)?;
        check_range("solver.max_view_error", self.max_view_error, 1.0..=1e9)
    }
}

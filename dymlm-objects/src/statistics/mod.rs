//! Quantiles of the distributions that the tests on centroids need.

mod fisher_f;
mod incomplete_beta;
mod student_t;

pub use fisher_f::fisher_f_quantile;
pub use student_t::student_t_quantile;

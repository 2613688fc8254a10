use dymlm_core::Plane;

use crate::linear_algebra::Symmetric3;
use crate::patches::Patch;

/// A finite plane in the world, as the tests use it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FinitePlane<'a> {
    pub(crate) plane: Plane,
    pub(crate) centroid: [f64; 3],
    /// Covariance of its inliers, weighted as in the fit, square metres.
    pub(crate) spread: Symmetric3,
    pub(crate) patch: &'a Patch,
}

use dymlm_core::Plane;

use crate::patches::Patch;

/// A finite plane in the world, as the tests use it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FinitePlane<'a> {
    pub(crate) plane: Plane,
    pub(crate) centroid: [f64; 3],
    pub(crate) patch: &'a Patch,
    /// The points that equation 3 counts (`B_c`): those along the detected plane's edge. `None` for a plane
    /// of the map, whose edge moves with each fusion: all its inliers count instead.
    pub(crate) edge_points: Option<&'a [[f64; 3]]>,
}

use dymlm_core::vector3::{difference, dot};

use crate::linear_algebra::plane_axes;

/// A plane's coordinate frame: an origin on the plane and two axes in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaneFrame {
    origin: [f64; 3],
    axes: [[f64; 3]; 2],
}

impl PlaneFrame {
    pub(crate) fn new(origin: [f64; 3], normal: [f64; 3]) -> Self {
        Self { origin, axes: plane_axes(normal) }
    }

    /// Coordinates of a point's projection onto the plane, metres.
    #[inline]
    pub(crate) fn to_plane(self, point: [f64; 3]) -> [f64; 2] {
        let offset = difference(point, self.origin);
        self.axes.map(|axis| dot(axis, offset))
    }

    /// The point of the plane at given coordinates.
    pub(crate) fn to_world(self, [u, v]: [f64; 2]) -> [f64; 3] {
        let [a, b] = self.axes;
        std::array::from_fn(|axis| self.origin[axis] + u * a[axis] + v * b[axis])
    }
}

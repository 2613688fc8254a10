use dymlm_core::vector3::{Vector3, along, cross, difference};

use super::rotation::Axes;
use crate::convex_polytope::VertexGraph;

/// How far a hull extends along three axes, and the vertices at the ends.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Extents {
    lengths: Vector3,
    /// The vertices at the lower and upper end of each axis.
    touching: [[u32; 2]; 3],
}

impl Extents {
    /// The extents of a hull, searched from vertices that touched other axes; the nearer these axes, the
    /// faster.
    pub(super) fn of(hull: &VertexGraph, axes: &Axes, near: [[u32; 2]; 3]) -> Self {
        let mut own = Self::default();
        for axis in 0..3 {
            let direction = axes[axis];
            let (low, down) = hull.farthest(direction.map(|x| -x), near[axis][0]);
            let (high, up) = hull.farthest(direction, near[axis][1]);
            own.lengths[axis] = up + down;
            own.touching[axis] = [low, high];
        }
        own
    }

    pub(super) fn lengths(&self) -> Vector3 {
        self.lengths
    }

    pub(super) fn touching(&self) -> [[u32; 2]; 3] {
        self.touching
    }

    pub(super) fn volume(&self) -> f64 {
        self.lengths.iter().product()
    }

    /// The gradient of the volume's logarithm as the axes turn, while the same vertices touch.
    pub(super) fn gradient(&self, hull: &VertexGraph, axes: &Axes) -> Vector3 {
        let vertices = hull.vertices();
        let mut gradient = [0.0; 3];
        for ((axis, length), [low, high]) in axes.iter().zip(self.lengths).zip(self.touching) {
            let across = difference(vertices[high as usize], vertices[low as usize]);
            gradient = along(gradient, 1.0 / length, cross(*axis, across));
        }
        gradient
    }
}

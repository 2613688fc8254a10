use super::marks::Marks;
use crate::lattice::{Key, Lattice};

/// The sensor's position, with what all rays from it share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayOrigin {
    pub(crate) point: [f32; 3],
    pub(crate) key: Key,
    resolution: f64,
    /// Distances along each axis to the upper and the lower border of the origin's cell, metres.
    borders: [[f64; 2]; 3],
}

/// Traversal of the cells between two points (Amanatides and Woo 1987), with the arithmetic of OctoMap's
/// `computeRayKeys`, operation by operation, so that the cells agree to the last one.
#[derive(Debug, Clone, Copy)]
struct Ray {
    /// Distance along the ray to the next border, for each axis, metres.
    next: [f64; 3],
    /// Distance along the ray between borders.
    between: [f64; 3],
    up: [bool; 3],
    length: f64,
}

impl RayOrigin {
    pub(crate) fn new(point: [f32; 3], key: Key, lattice: &Lattice) -> Self {
        let resolution = lattice.resolution;
        let borders = std::array::from_fn(|axis| {
            [1.0, -1.0].map(|step| {
                let border = lattice.center(key[axis]) + f64::from((step * resolution * 0.5) as f32);
                border - f64::from(point[axis])
            })
        });
        Self { point, key, resolution, borders }
    }

    /// Distance to a point as OctoMap computes it: squares summed in single precision, the root taken in
    /// double.
    #[inline]
    pub(crate) fn distance(&self, point: [f32; 3]) -> f64 {
        norm(difference(point, self.point))
    }

    /// The point at `range` on the way to `point`.
    #[inline]
    pub(crate) fn cut(&self, point: [f32; 3], range: f64) -> [f32; 3] {
        let offset = difference(point, self.point);
        let length = norm(offset) as f32;
        std::array::from_fn(|axis| self.point[axis] + offset[axis] / length * range as f32)
    }

    fn ray_to(&self, end: [f32; 3]) -> Ray {
        let offset = difference(end, self.point);
        let length = norm(offset) as f32;
        let mut ray =
            Ray { next: [f64::MAX; 3], between: [f64::MAX; 3], up: [true; 3], length: f64::from(length) };
        for (axis, offset) in offset.into_iter().enumerate() {
            let direction = f64::from(offset / length);
            if direction != 0.0 {
                ray.up[axis] = direction > 0.0;
                ray.next[axis] = self.borders[axis][usize::from(direction < 0.0)] / direction;
                ray.between[axis] = self.resolution / direction.abs();
            }
        }
        ray
    }

    /// Marks the cells from the origin's to the one before the end's as passed; none when both are the same.
    #[inline]
    pub(crate) fn pass_to<M: Marks>(&self, end: [f32; 3], end_key: Key, marks: &mut M) {
        if end_key == self.key {
            return;
        }
        let Ray { next: [mut x, mut y, mut z], between: [dx, dy, dz], up, length } = self.ray_to(end);
        let mut cursor = marks.cursor(self.key, up);
        let last = marks.cursor(end_key, up);
        marks.pass(&cursor);
        // The square of an offset may underflow. Such a ray has no direction; OctoMap's ends here too.
        if length == 0.0 {
            return;
        }
        loop {
            // OctoMap's order of comparisons decides ties.
            let axis = if x < y {
                if x < z { 0 } else { 2 }
            } else if y < z {
                1
            } else {
                2
            };
            match axis {
                0 => {
                    x += dx;
                    M::advance::<0>(&mut cursor);
                }
                1 => {
                    y += dy;
                    M::advance::<1>(&mut cursor);
                }
                _ => {
                    z += dz;
                    M::advance::<2>(&mut cursor);
                }
            }
            let yz = if y < z { y } else { z };
            let nearest = if x < yz { x } else { yz };
            // Rounding may carry the ray past its last cell; then its length ends it.
            if M::same(&cursor, &last) || nearest > length {
                return;
            }
            marks.pass(&cursor);
        }
    }
}

#[inline]
fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// OctoMap's `norm`.
#[inline]
fn norm(v: [f32; 3]) -> f64 {
    f64::from(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

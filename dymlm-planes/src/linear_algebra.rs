//! Symmetric 3x3 matrices and coordinates in a plane, as far as plane fitting needs them.

use dymlm_core::vector3::{cross, unit};
use dymlm_core::{Plane, symmetric_eigen3};

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric3 = [f64; 6];

/// The point of a plane that is nearest to a point.
#[inline]
pub(crate) fn foot_on(plane: &Plane, point: [f64; 3]) -> [f64; 3] {
    let (normal, distance) = (plane.normal(), plane.signed_distance(point));
    std::array::from_fn(|axis| point[axis] - distance * normal[axis])
}

/// v' A v.
#[inline]
pub(crate) fn quadratic_form(matrix: &Symmetric3, v: [f64; 3]) -> f64 {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let [x, y, z] = v;
    x * (xx * x + 2.0 * (xy * y + xz * z)) + y * (yy * y + 2.0 * yz * z) + zz * z * z
}

/// Two unit vectors that complete a unit `normal` to a right-handed frame (u, v, normal).
///
/// The first lies in the coordinate plane of the normal's two largest components. Equal normals give equal
/// frames.
pub(crate) fn plane_axes(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let [x, y, z] = normal.map(f64::abs);
    let helper = if x <= y && x <= z {
        [1.0, 0.0, 0.0]
    } else if y <= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let u = unit(cross(helper, normal)).unwrap_or([1.0, 0.0, 0.0]);
    [u, cross(normal, u)]
}

/// The matrix by rows, as the eigenvalue solver of `dymlm-core` takes it.
pub(crate) fn rows(matrix: &Symmetric3) -> [[f64; 3]; 3] {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// Width across the longest extent of points with this covariance, by rows: of a rectangle over which points are
/// spread evenly. Over a width w they have the variance w^2 / 12.
pub(crate) fn width(covariance: [[f64; 3]; 3]) -> f64 {
    let across = symmetric_eigen3(covariance).map_or(0.0, |eigen| eigen.values[1]);
    (12.0 * across.max(0.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use dymlm_core::vector3::{difference, dot, norm};

    use super::*;

    #[test]
    fn axes_complete_a_right_handed_frame() {
        for normal in [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.36, 0.48, -0.8]] {
            let [u, v] = plane_axes(normal);
            assert!(dot(u, v).abs() < 1e-12 && dot(u, normal).abs() < 1e-12);
            assert!(norm(difference(cross(u, v), normal)) < 1e-12);
        }
    }
}

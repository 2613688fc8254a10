//! Symmetric 3x3 matrices: what fitting planes needs, and no more.
//!
//! A covariance is fitted many thousand times a frame. Its smallest eigenvalue is the root of a cubic: Newton's method
//! from 0 climbs to it without ever passing it, since all roots are real and none is negative; on flat data three steps
//! do. The eigenvector is the longest cross product of two rows of A - lambda I.

use dymlm_core::Plane;
use dymlm_core::vector3::{cross, dot, norm};

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
pub(crate) type Symmetric3 = [f64; 6];

/// The vector at unit length; `None` when it has no direction.
#[inline]
pub(crate) fn normalized(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(a);
    (length.is_finite() && length > 1e-150).then(|| a.map(|x| x / length))
}

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
/// The first lies in the coordinate plane of the normal's two largest components, so equal normals give equal frames.
pub(crate) fn plane_axes(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let [x, y, z] = normal.map(f64::abs);
    let helper = if x <= y && x <= z {
        [1.0, 0.0, 0.0]
    } else if y <= z {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let u = normalized(cross(helper, normal)).unwrap_or([1.0, 0.0, 0.0]);
    [u, cross(normal, u)]
}

/// The smallest eigenvalue of a positive semidefinite matrix.
#[inline]
pub(crate) fn smallest_eigenvalue(matrix: &Symmetric3) -> f64 {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let trace = xx + yy + zz;
    let (minor_x, minor_y, minor_z) = (yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy);
    let minors = minor_x + minor_y + minor_z;
    let determinant = xx * minor_x - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    let mut root = 0.0;
    // A triple root is approached by a third a step, all others quadratically.
    for _ in 0..48 {
        let value = ((root - trace) * root + minors) * root - determinant;
        let slope = (3.0 * root - 2.0 * trace) * root + minors;
        if slope <= 0.0 {
            break;
        }
        let step = value / slope;
        root -= step;
        if step.abs() <= 1e-9 * root.abs() {
            break;
        }
    }
    root.max(0.0)
}

/// All eigenvalues of a symmetric matrix, ascending (Smith, "Eigenvalues of a symmetric 3x3 matrix", CACM 1961).
pub(crate) fn eigenvalues(matrix: &Symmetric3) -> [f64; 3] {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let mean = (xx + yy + zz) / 3.0;
    let spread = (xx - mean).powi(2) + (yy - mean).powi(2) + (zz - mean).powi(2);
    let radius = ((spread + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0).sqrt();
    if radius <= 1e-15 * mean.abs() || radius == 0.0 {
        return [mean; 3];
    }
    let [a, b, c, d, e, f] = [xx - mean, xy, xz, yy - mean, yz, zz - mean].map(|value| value / radius);
    let determinant = a * (d * f - e * e) - b * (b * f - e * c) + c * (b * e - d * c);
    let angle = (0.5 * determinant).clamp(-1.0, 1.0).acos() / 3.0;
    let largest = mean + 2.0 * radius * angle.cos();
    let smallest = mean + 2.0 * radius * (angle + std::f64::consts::TAU / 3.0).cos();
    [smallest, 3.0 * mean - largest - smallest, largest]
}

/// A unit eigenvector of `eigenvalue`; `None` when the matrix has the same eigenvalue in every direction.
///
/// Of a double eigenvalue any one of its eigenvectors.
pub(crate) fn eigenvector(matrix: &Symmetric3, eigenvalue: f64) -> Option<[f64; 3]> {
    let [xx, xy, xz, yy, yz, zz] = *matrix;
    let rows = [[xx - eigenvalue, xy, xz], [xy, yy - eigenvalue, yz], [xz, yz, zz - eigenvalue]];
    let crosses = [cross(rows[0], rows[1]), cross(rows[0], rows[2]), cross(rows[1], rows[2])];
    let longest = longest_of(crosses);
    let scale = rows.iter().map(|row| dot(*row, *row)).fold(0.0, f64::max);
    if scale == 0.0 || !scale.is_finite() {
        return None;
    }
    if dot(longest, longest) > 1e-24 * scale * scale {
        return normalized(longest);
    }
    // Rows of rank one: everything across them is an eigenvector.
    normalized(longest_of(rows)).map(|row| plane_axes(row)[0])
}

fn longest_of(vectors: [[f64; 3]; 3]) -> [f64; 3] {
    let mut longest = vectors[0];
    for vector in &vectors[1..] {
        if dot(*vector, *vector) > dot(longest, longest) {
            longest = *vector;
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, SymmetricEigen, Vector3};
    use proptest::prelude::*;

    use dymlm_core::vector3::difference;

    use super::*;

    fn dense(m: &Symmetric3) -> Matrix3<f64> {
        Matrix3::new(m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5])
    }

    /// Q diag(values) Q' for a rotation given by an axis-angle vector.
    fn with_eigenvalues(values: [f64; 3], turn: [f64; 3]) -> Symmetric3 {
        let q = nalgebra::Rotation3::new(Vector3::from(turn)).into_inner();
        let m = q * Matrix3::from_diagonal(&Vector3::from(values)) * q.transpose();
        [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]]
    }

    proptest! {
        /// nalgebra's iterative solver as the oracle, from flat to round and over the magnitudes of real covariances.
        #[test]
        fn agrees_with_nalgebra(
            exponents in prop::array::uniform3(-7.0..1.0_f64),
            turn in prop::array::uniform3(-3.0..3.0_f64),
        ) {
            let matrix = with_eigenvalues(exponents.map(|e| 10_f64.powf(e)), turn);
            let mut expected: Vec<f64> = SymmetricEigen::new(dense(&matrix)).eigenvalues.iter().copied().collect();
            expected.sort_by(f64::total_cmp);
            let scale = expected[2];
            for (ours, theirs) in eigenvalues(&matrix).iter().zip(&expected) {
                prop_assert!((ours - theirs).abs() <= 1e-7 * scale);
            }
            // The determinant is rounded to 1e-16 of its largest term; on needles that shows.
            let rounding = 1e-14 * scale * scale / expected[1];
            let smallest = smallest_eigenvalue(&matrix);
            prop_assert!((smallest - expected[0]).abs() <= 1e-6 * expected[0] + rounding);
            let vector = eigenvector(&matrix, smallest).unwrap();
            let residual = dense(&matrix) * Vector3::from(vector) - smallest * Vector3::from(vector);
            prop_assert!(residual.norm() <= 1e-6 * scale, "{} of {scale}", residual.norm());
            prop_assert!((quadratic_form(&matrix, vector) - smallest).abs() <= 1e-8 * scale + rounding);
        }
    }

    #[test]
    fn equal_eigenvalues_are_no_trouble() {
        assert_eq!(eigenvalues(&[2.0, 0.0, 0.0, 2.0, 0.0, 2.0]), [2.0; 3]);
        assert!((smallest_eigenvalue(&[2.0, 0.0, 0.0, 2.0, 0.0, 2.0]) - 2.0).abs() < 1e-4);
        assert_eq!(eigenvector(&[2.0, 0.0, 0.0, 2.0, 0.0, 2.0], 2.0), None);
        assert_eq!(smallest_eigenvalue(&[0.0; 6]), 0.0);
        assert_eq!(eigenvector(&[0.0; 6], 0.0), None);
        // A line: the smallest eigenvalue is double; any vector across the line will do.
        let along_x = [4.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let across = eigenvector(&along_x, smallest_eigenvalue(&along_x)).unwrap();
        assert!(across[0].abs() < 1e-12 && (norm(across) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn axes_complete_a_right_handed_frame() {
        for normal in [[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [0.36, 0.48, -0.8]] {
            let [u, v] = plane_axes(normal);
            assert!(dot(u, v).abs() < 1e-12 && dot(u, normal).abs() < 1e-12);
            assert!(norm(difference(cross(u, v), normal)) < 1e-12);
        }
    }
}

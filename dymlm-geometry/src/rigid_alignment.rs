use dymlm_core::vector3::{along, combined, cross, difference, dot, norm, unit};
use dymlm_core::{Pose, symmetric_eigen3};

/// Points whose spread across their line is below this share of their spread along it have no rotation.
const LEAST_SPREAD: f64 = 1e-6;

/// The motion that takes points of frame b to their partners in frame a with the least sum of squares,
/// `a_from_b`.
///
/// Umeyama: "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", TPAMI 1991,
/// without scale. O(points). `None` when fewer than three pairs are finite or all points lie on a line;
/// points beyond the length of the shorter list are ignored.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_geometry::rigid_alignment;
///
/// let half = 0.5_f64.sqrt();
/// let a_from_b = Pose::new([1.0, -2.0, 0.5], [0.0, half, 0.0, half])?;
/// let in_b = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.3, 0.1, 1.0]];
/// let in_a = in_b.map(|point| a_from_b.transform_point(point));
/// let found = rigid_alignment(&in_b, &in_a).ok_or("four points in space")?;
/// assert!(found.distance(&a_from_b) < 1e-9 && found.angle(&a_from_b) < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn rigid_alignment(in_b: &[[f64; 3]], in_a: &[[f64; 3]]) -> Option<Pose> {
    let is_finite = |p: &[f64; 3]| p.iter().all(|x| x.is_finite());
    let pairs = || in_b.iter().zip(in_a).filter(|(b, a)| is_finite(b) && is_finite(a));
    let count = pairs().count();
    if count < 3 {
        return None;
    }
    let scale = 1.0 / count as f64;
    let [mut mean_b, mut mean_a] = [[0.0; 3]; 2];
    for (&b, &a) in pairs() {
        (mean_b, mean_a) = (along(mean_b, scale, b), along(mean_a, scale, a));
    }
    let mut covariance = [[0.0; 3]; 3];
    for (&b, &a) in pairs() {
        let (a, b) = (difference(a, mean_a), difference(b, mean_b));
        for (row, a) in covariance.iter_mut().zip(a) {
            *row = along(*row, scale * a, b);
        }
    }
    let rotation = rotation_of(covariance)?;
    let moved = rotation.map(|row| dot(row, mean_b));
    Pose::from_rotation_matrix(rotation, difference(mean_a, moved)).ok()
}

/// The rotation R that makes the trace of R^T covariance largest, by rows. The third singular vectors are the
/// cross products of the other two: so the weakest direction is flipped where a reflection, which is no
/// motion, would fit better.
fn rotation_of(covariance: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let column = |k: usize| covariance.map(|row| row[k]);
    let square = [0, 1, 2].map(|k| [0, 1, 2].map(|l| dot(column(k), column(l))));
    let [first_b, second_b, _] = symmetric_eigen3(square)?.vectors;
    // Their lengths are the singular values, descending.
    let [first, second] = [first_b, second_b].map(|b| covariance.map(|row| dot(row, b)));
    let largest = norm(first);
    if largest <= 0.0 || norm(second) <= LEAST_SPREAD * largest {
        return None;
    }
    let [first_a, second] = [first, second].map(|vector| vector.map(|x| x / largest));
    let second_a = unit(along(second, -dot(first_a, second), first_a))?;
    let (third_a, third_b) = (cross(first_a, second_a), cross(first_b, second_b));
    let row = |k: usize| along(combined(first_a[k], first_b, second_a[k], second_b), third_a[k], third_b);
    Some([0, 1, 2].map(row))
}

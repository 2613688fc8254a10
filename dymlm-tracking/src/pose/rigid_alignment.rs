use dymlm_core::Pose;
use nalgebra::{Matrix3, Vector3};

/// Points whose spread across their line is below this share of that along it have no rotation.
const LEAST_SPREAD: f64 = 1e-6;

/// The motion that takes points of frame b to their partners in frame a with the least sum of squares,
/// `a_from_b`.
///
/// Umeyama: "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", TPAMI 1991,
/// without scale. O(points). `None` when fewer than three pairs are finite or all points lie on a line; pairs
/// beyond the shorter list are passed over.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_tracking::rigid_alignment;
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
    let [mut mean_b, mut mean_a] = [Vector3::zeros(); 2];
    for (&b, &a) in pairs() {
        mean_b += Vector3::from(b) * scale;
        mean_a += Vector3::from(a) * scale;
    }
    let mut covariance = Matrix3::zeros();
    for (&b, &a) in pairs() {
        covariance += (Vector3::from(a) - mean_a) * (Vector3::from(b) - mean_b).transpose() * scale;
    }
    let rotation = rotation_of(&covariance)?;
    let translation = mean_a - rotation * mean_b;
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| rotation[(row, column)]));
    Pose::from_rotation_matrix(rows, translation.into()).ok()
}

/// The rotation R that makes the trace of R^T covariance largest.
fn rotation_of(covariance: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    if !covariance.iter().all(|x| x.is_finite()) {
        return None;
    }
    // Descending singular values.
    let svd = covariance.try_svd(true, true, f64::EPSILON, 200)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let spread = svd.singular_values;
    if spread[0] <= 0.0 || spread[1] <= LEAST_SPREAD * spread[0] {
        return None;
    }
    // A reflection is no motion: the weakest direction is turned round.
    let sign = (u.determinant() * v_t.determinant()).signum();
    Some(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t)
}

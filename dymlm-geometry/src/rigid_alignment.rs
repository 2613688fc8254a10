use dymlm_core::vector3::{along, any_across, combined, cross, difference, dot, norm};
use dymlm_core::{Pose, symmetric_eigen3};

/// Points whose variance across their line is below this share of their variance along it have no rotation:
/// a spread of a third of a millimetre across a corridor of 100 m. Rounding is 1e-16 of the larger variance.
const LEAST_VARIANCE: f64 = 1e-10;

/// The motion that takes points of frame b to their partners in frame a with the least sum of squares,
/// `a_from_b`.
///
/// Umeyama: "Least-Squares Estimation of Transformation Parameters Between Two Point Patterns", TPAMI 1991,
/// without scale. O(points). `None` when fewer than three pairs are finite or all points lie on a line, which
/// they do when their spread across it (root mean square) is below 1e-5 of that along it; points beyond the
/// length of the shorter list are ignored.
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

/// The rotation R that makes the trace of R^T covariance largest, by rows. It takes the first right singular
/// vector to the first left one, so that a turn about that direction remains, in which a reflection, which is
/// no motion, has no part. The turn is read from the covariance itself: singular vectors would come from its
/// square, in which small variances are lost.
fn rotation_of(covariance: [[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let column = |k: usize| covariance.map(|row| row[k]);
    let square = [0, 1, 2].map(|k| [0, 1, 2].map(|l| dot(column(k), column(l))));
    let [first_b, second_b, _] = symmetric_eigen3(square)?.vectors;
    let image = |b: [f64; 3]| covariance.map(|row| dot(row, b));
    // Its length is the largest singular value.
    let along_b = image(first_b);
    let largest = norm(along_b);
    if largest <= 0.0 {
        return None;
    }
    let first_a = along_b.map(|x| x / largest);
    let third_b = cross(first_b, second_b);
    let second_a = any_across(first_a);
    let third_a = cross(first_a, second_a);
    let [[ss, st], [ts, tt]] =
        [second_a, third_a].map(|a| [second_b, third_b].map(|b| dot(a, image(b)) / largest));
    if ss.hypot(st).hypot(ts.hypot(tt)) <= LEAST_VARIANCE {
        return None;
    }
    let (sin, cos) = (ts - st).atan2(ss + tt).sin_cos();
    let turned = [combined(cos, second_a, sin, third_a), combined(-sin, second_a, cos, third_a)];
    let row = |k: usize| along(combined(first_a[k], first_b, turned[0][k], second_b), turned[1][k], third_b);
    Some([0, 1, 2].map(row))
}

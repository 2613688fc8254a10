//! SE(3) and its tangent space: six numbers, the rotation first, applied from the right (in the body's own
//! frame).
//!
//! Equations: Barfoot, "State Estimation for Robotics", 7.1; Solà, Deray, Atchuthan, "A micro Lie theory",
//! arXiv 1812.01537.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

/// Below this angle, radians, series replace quotients of vanishing numbers.
const SMALL: f64 = 1e-3;

pub(crate) fn skew(v: Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

fn parts(tangent: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (tangent.fixed_rows::<3>(0).into(), tangent.fixed_rows::<3>(3).into())
}

pub(crate) fn exp(tangent: &Vector6<f64>) -> Isometry3<f64> {
    let (rotation, velocity) = parts(tangent);
    let translation = left_jacobian(rotation) * velocity;
    Isometry3::from_parts(Translation3::from(translation), UnitQuaternion::from_scaled_axis(rotation))
}

pub(crate) fn log(pose: &Isometry3<f64>) -> Vector6<f64> {
    let rotation = pose.rotation.scaled_axis();
    let velocity = left_jacobian_inverse(rotation) * pose.translation.vector;
    Vector6::new(rotation.x, rotation.y, rotation.z, velocity.x, velocity.y, velocity.z)
}

/// Maps tangents at one end of a motion to those at its other end.
pub(crate) fn adjoint(pose: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = *pose.rotation.to_rotation_matrix().matrix();
    blocks(rotation, skew(pose.translation.vector) * rotation)
}

/// A matrix with one block for both rotation and translation, and a block by which rotation adds to
/// translation.
fn blocks(diagonal: Matrix3<f64>, lower: Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&diagonal);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&diagonal);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&lower);
    matrix
}

/// The left Jacobian of SO(3).
fn left_jacobian(rotation: Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (rotation.norm(), skew(rotation));
    let square = angle * angle;
    let (a, b) = if angle < SMALL {
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        ((1.0 - angle.cos()) / square, (angle - angle.sin()) / (square * angle))
    };
    Matrix3::identity() + cross * a + cross * cross * b
}

fn left_jacobian_inverse(rotation: Vector3<f64>) -> Matrix3<f64> {
    let (angle, cross) = (rotation.norm(), skew(rotation));
    let square = angle * angle;
    let a = if angle < SMALL {
        1.0 / 12.0 + square / 720.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * half.cos() / half.sin()) / square
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * a
}

/// The inverse of the right Jacobian: how [`log`], which is `tangent`, changes when the pose is moved by a
/// small step from the right.
pub(crate) fn right_jacobian_inverse(tangent: &Vector6<f64>) -> Matrix6<f64> {
    // It is the inverse of the left Jacobian of the inverse motion.
    let (rotation, velocity) = parts(&-tangent);
    let inverse = left_jacobian_inverse(rotation);
    blocks(inverse, -inverse * coupling(rotation, velocity) * inverse)
}

/// How rotation and translation interact in the left Jacobian of SE(3) (Barfoot, equation 7.86b).
fn coupling(rotation: Vector3<f64>, velocity: Vector3<f64>) -> Matrix3<f64> {
    let (angle, r, v) = (rotation.norm(), skew(rotation), skew(velocity));
    let square = angle * angle;
    let [a, b, c] = if angle < SMALL {
        [1.0 / 6.0 - square / 120.0, 1.0 / 24.0 - square / 720.0, 1.0 / 120.0 - square / 2520.0]
    } else {
        let (sin, cos) = angle.sin_cos();
        let fourth = square * square;
        [
            (angle - sin) / (square * angle),
            (square + 2.0 * cos - 2.0) / (2.0 * fourth),
            (2.0 * angle - 3.0 * sin + angle * cos) / (2.0 * fourth * angle),
        ]
    };
    v * 0.5
        + (r * v + v * r + r * v * r) * a
        + (r * r * v + v * r * r - r * v * r * 3.0) * b
        + (r * v * r * r + r * r * v * r) * c
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tangents() -> impl Iterator<Item = Vector6<f64>> {
        let mut random = dymlm_core::SplitMix64::new(4);
        [1e-9, 1e-4, 1e-3, 0.1, 1.0, 2.0].into_iter().map(move |size| {
            Vector6::from_fn(|k, _| (random.fraction() - 0.5) * if k < 3 { size } else { 3.0 })
        })
    }

    #[test]
    fn log_is_the_inverse_of_exp() {
        for tangent in tangents() {
            assert!((log(&exp(&tangent)) - tangent).norm() < 1e-12, "{tangent}");
        }
    }

    #[test]
    fn exp_is_a_flow() {
        for tangent in tangents() {
            let half = exp(&(tangent * 0.5));
            assert!((log(&(half * half)) - tangent).norm() < 1e-12);
        }
    }

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let step = 1e-6;
        for tangent in tangents() {
            let jacobian = right_jacobian_inverse(&tangent);
            for k in 0..6 {
                let moved = |sign: f64| {
                    let mut small = Vector6::zeros();
                    small[k] = sign * step;
                    log(&(exp(&tangent) * exp(&small)))
                };
                let expected = (moved(1.0) - moved(-1.0)) / (2.0 * step);
                assert!((jacobian.column(k) - expected).norm() < 1e-8, "{tangent} {k}");
            }
        }
    }

    #[test]
    fn the_adjoint_moves_a_step_to_the_other_side() {
        let tangents: Vec<_> = tangents().collect();
        for (pose, small) in tangents.iter().zip(&tangents) {
            let (pose, small) = (exp(pose), small * 0.1);
            let moved = exp(&(adjoint(&pose) * small)) * pose;
            assert!((log(&moved) - log(&(pose * exp(&small)))).norm() < 1e-10);
        }
    }
}

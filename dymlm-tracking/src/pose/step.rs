use dymlm_core::Pose;
use nalgebra::{UnitQuaternion, Vector3, Vector6};

/// Rotates a body about its own origin and moves the origin. The step is (rotation vector, radians;
/// translation, metres), both along the axes of the frame that the pose leads to.
pub(crate) fn moved(pose: &Pose, step: &Vector6<f64>) -> Pose {
    let turn = rotation_about([step[0], step[1], step[2]]);
    let [x, y, z] = pose.translation();
    let turned = turn * *pose;
    Pose::new([x + step[3], y + step[4], z + step[5]], turned.quaternion()).unwrap_or(*pose)
}

/// The step with which [`moved`] takes `from` to `to`.
pub(crate) fn step_between(from: &Pose, to: &Pose) -> Vector6<f64> {
    let [x, y, z, w] = (*to * from.inverse()).quaternion();
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    let sine = (x * x + y * y + z * z).sqrt();
    let factor = if sine < 1e-12 { 2.0 } else { 2.0 * sine.atan2(sign * w) / sine };
    let [a, b] = [from.translation(), to.translation()];
    let turn = Vector3::new(x, y, z) * (sign * factor);
    Vector6::new(turn.x, turn.y, turn.z, b[0] - a[0], b[1] - a[1], b[2] - a[2])
}

/// The rotation about an axis by its length, radians.
pub(crate) fn rotation_about(axis: [f64; 3]) -> Pose {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(axis));
    Pose::new([0.0; 3], rotation.coords.into()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leads_from_one_pose_to_the_other() {
        let from = Pose::new([0.3, -0.1, 1.2], [0.1, 0.2, -0.3, 0.86_f64.sqrt()]).unwrap();
        let step = Vector6::new(0.4, -0.2, 0.9, 0.05, 0.1, -0.3);
        let to = moved(&from, &step);
        assert!((step_between(&from, &to) - step).amax() < 1e-12);
        assert_eq!(step_between(&from, &from), Vector6::zeros());
    }

    #[test]
    fn more_than_half_a_turn_is_taken_the_short_way() {
        let from = Pose::identity();
        let to = Pose::new([0.0; 3], [0.0, 0.0, -0.1, -(0.99_f64.sqrt())]).unwrap();
        assert!((step_between(&from, &to)[2] - 2.0 * 0.1_f64.asin()).abs() < 1e-9);
    }
}

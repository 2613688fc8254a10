//! Poses: the group laws, matrices, interpolation, and what is refused.

use dymlm_core::{Error, Pose};
use proptest::prelude::*;

fn any_pose() -> impl Strategy<Value = Pose> {
    let unit = -1.0..1.0_f64;
    ([unit.clone(), unit.clone(), unit.clone(), unit], [-50.0..50.0_f64, -50.0..50.0, -50.0..50.0])
        .prop_filter_map("a quaternion near zero has no direction", |(q, translation)| {
            let norm = q.iter().map(|value| value * value).sum::<f64>().sqrt();
            (norm > 0.1).then(|| Pose::new(translation, q.map(|value| value / norm)).unwrap())
        })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

proptest! {
    #[test]
    fn inverse_undoes(pose in any_pose(), point in [-9.0..9.0_f64, -9.0..9.0, -9.0..9.0]) {
        prop_assert!(distance(pose.inverse().transform_point(pose.transform_point(point)), point) < 1e-9);
        prop_assert!((pose * pose.inverse()).distance(&Pose::identity()) < 1e-9);
    }

    #[test]
    fn composition_is_one_after_the_other(a in any_pose(), b in any_pose(), point in [-9.0..9.0_f64, -9.0..9.0, -9.0..9.0]) {
        prop_assert!(distance((a * b).transform_point(point), a.transform_point(b.transform_point(point))) < 1e-9);
    }

    /// Regression: normalized again, its last bits changed, and a map took the frame for one that had moved.
    #[test]
    fn a_pose_that_is_handed_back_in_its_parts_is_the_same_to_the_bit(
        poses in prop::collection::vec(any_pose(), 1..5),
    ) {
        let pose = poses.iter().fold(Pose::identity(), |product, pose| product * *pose);
        prop_assert_eq!(Pose::new(pose.translation(), pose.quaternion()).unwrap(), pose);
    }

    #[test]
    fn a_rotation_matrix_gives_the_same_pose(pose in any_pose()) {
        let again = Pose::from_rotation_matrix(pose.rotation_matrix(), pose.translation()).unwrap();
        prop_assert!(again.angle(&pose) < 1e-7);
        prop_assert!(again.distance(&pose) < 1e-12);
    }

    #[test]
    fn interpolation_starts_and_ends_and_is_even(a in any_pose(), b in any_pose()) {
        prop_assert!(a.interpolate(&b, 0.0).angle(&a) < 1e-6);
        prop_assume!(a.angle(&b) < 3.1);
        prop_assert!(a.interpolate(&b, 1.0).angle(&b) < 1e-6);
        prop_assert!((a.interpolate(&b, 0.25).angle(&a) - 0.25 * a.angle(&b)).abs() < 1e-6);
        prop_assert!((a.interpolate(&b, 0.25).distance(&a) - 0.25 * a.distance(&b)).abs() < 1e-9);
    }
}

/// `scipy.spatial.transform.Rotation.from_quat([-0.00366572, -0.16087849, -0.13950506,
/// 0.97705835]).as_matrix()`, scipy 1.17.1 (the first pose of the kitchen sequence).
#[test]
fn agrees_with_scipy() {
    let pose = Pose::new([0.0; 3], [-0.003_665_72, -0.160_878_49, -0.139_505_06, 0.977_058_35]).unwrap();
    let expected = [
        [0.909_312_900, 0.273_788_637, -0.313_352_569],
        [-0.271_429_695, 0.961_049_802, 0.052_049_971],
        [0.315_398_115, 0.037_723_482, 0.948_209_348],
    ];
    let matrix = pose.rotation_matrix();
    for row in 0..3 {
        assert!(distance(matrix[row], expected[row]) < 1e-8, "row {row}: {:?}", matrix[row]);
    }
}

#[test]
fn refuses_what_is_no_pose() {
    assert!(matches!(Pose::new([0.0; 3], [0.0; 4]), Err(Error::Pose { .. })));
    assert!(matches!(Pose::new([f64::NAN, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]), Err(Error::Pose { .. })));
    assert!(matches!(Pose::new([0.0; 3], [0.0, f64::INFINITY, 0.0, 1.0]), Err(Error::Pose { .. })));
    let mirror = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(matches!(Pose::from_rotation_matrix(mirror, [0.0; 3]), Err(Error::Rotation(_))));
}

//! Principal axes against nalgebra's eigenvectors of a covariance summed plainly, and on degenerate clouds.
use dymlm_core::Point;
use dymlm_geometry::PrincipalAxes;
use dymlm_test_support::cases;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use proptest::prelude::*;

/// Mean and covariance in two passes, point by point.
fn two_passes(points: &[Point]) -> (Vector3<f64>, Matrix3<f64>) {
    let places = || points.iter().map(|p| Vector3::from(p.map(f64::from)));
    let count = points.len() as f64;
    let mean = places().sum::<Vector3<f64>>() / count;
    let covariance = places().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>();
    (mean, covariance / count)
}

fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| rows[row][column])
}

fn check(found: &PrincipalAxes, points: &[Point]) -> Result<(), TestCaseError> {
    let (mean, covariance) = two_passes(points);
    let scale = covariance.amax().max(1e-30);
    let offset = points.iter().flatten().fold(0.0_f32, |greatest, x| greatest.max(x.abs()));
    prop_assert!((Vector3::from(found.centroid) - mean).amax() <= 1e-14 * f64::from(offset));
    prop_assert!((matrix(found.covariance) - covariance).amax() <= 1e-12 * scale);
    let mut variances: [f64; 3] = SymmetricEigen::new(covariance).eigenvalues.into();
    variances.sort_by(|a, b| b.total_cmp(a));
    for (ours, theirs) in found.variances.into_iter().zip(variances) {
        prop_assert!((ours - theirs).abs() <= 1e-12 * scale && ours >= 0.0);
    }
    let axes = matrix(found.axes).transpose();
    prop_assert!((axes.determinant() - 1.0).abs() < 1e-14);
    prop_assert!(
        (covariance * axes - axes * Matrix3::from_diagonal(&Vector3::from(variances))).amax()
            <= 1e-12 * scale
    );
    Ok(())
}

fn clouds() -> impl Strategy<Value = Vec<Point>> {
    (
        prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), 1..200),
        prop::array::uniform3(0.0..2.0_f32),
        prop::array::uniform3(-100.0..100.0_f32),
    )
        .prop_map(|(points, size, offset)| {
            points.iter().map(|p| std::array::from_fn(|axis| p[axis] * size[axis] + offset[axis])).collect()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(200)))]

    #[test]
    fn equal_two_passes_and_nalgebra(points in clouds()) {
        let found = PrincipalAxes::of(&points).unwrap();
        prop_assert_eq!(found.count, points.len());
        check(&found, &points)?;
    }

    #[test]
    fn points_that_are_no_numbers_are_passed_over(points in clouds(), holes in prop::collection::vec((0..200_usize, 0..3_usize, 0..3_usize), 1..9)) {
        let mut all = points.clone();
        for (place, axis, kind) in holes {
            let mut hole = [0.1; 3];
            hole[axis] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][kind];
            all.insert(place.min(all.len()), hole);
        }
        let found = PrincipalAxes::of(&all).unwrap();
        prop_assert_eq!(found.count, points.len());
        check(&found, &points)?;
    }

    /// A disc of known spread, turned and far off: axes and rank survive f32 coordinates.
    #[test]
    fn a_turned_plate_has_its_normal_last(angles in prop::array::uniform3(-3.0..3.0_f64), far in 0.0..20.0_f64) {
        let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
        let points: Vec<Point> = (0..400)
            .map(|i| rotation * Vector3::new(0.1 * f64::from(i % 20), 0.05 * f64::from(i / 20), 0.0))
            .map(|p| [p.x as f32, p.y as f32, (p.z + far) as f32])
            .collect();
        let found = PrincipalAxes::of(&points).unwrap();
        prop_assert_eq!(found.rank, 2);
        for (axis, column) in found.axes.into_iter().zip([0, 1, 2]) {
            prop_assert!(Vector3::from(axis).dot(&rotation.matrix().column(column)).abs() > 1.0 - 1e-9);
        }
    }
}

#[test]
fn ranks_of_degenerate_clouds() {
    assert_eq!(PrincipalAxes::of(&[]), None);
    assert_eq!(PrincipalAxes::of(&[[f32::NAN; 3], [0.0, f32::INFINITY, 0.0]]), None);
    let rank = |points: &[Point]| PrincipalAxes::of(points).unwrap().rank;
    assert_eq!(rank(&[[0.1, 0.2, 0.3]; 100]), 0);
    assert_eq!(rank(&[[0.1, 0.2, 0.3], [0.4, 0.4, 0.4]]), 1);
    assert_eq!(rank(&[[0.1, 0.2, 0.3], [0.4, 0.4, 0.4], [-0.3, 0.9, 0.1]]), 2);
    assert_eq!(rank(&[[0.1, 0.2, 0.3], [0.4, 0.4, 0.4], [-0.3, 0.9, 0.1], [0.0, 0.0, 1.0]]), 3);
    // One place: x, y, z.
    let place = PrincipalAxes::of(&[[5.0, 6.0, 7.0]]).unwrap();
    assert_eq!(place.axes, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!((place.centroid, place.variances, place.count), ([5.0, 6.0, 7.0], [0.0; 3], 1));
}

#[test]
fn huge_coordinates_do_not_overflow() {
    let found = PrincipalAxes::of(&[[f32::MAX, 0.0, 0.0], [-f32::MAX, 0.0, 0.0], [0.0, 1.0, 0.0]]).unwrap();
    assert!(found.variances[0].is_finite() && found.axes[0] == [1.0, 0.0, 0.0], "{found:?}");
}

//! The 3x3 eigensolver against nalgebra's, against its own definition, and on matrices with equal
//! eigenvalues.
use dymlm_core::{SymmetricEigen3, symmetric_eigen3};
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Vector3};
use proptest::prelude::*;

fn rows(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[(row, column)]))
}

/// Largest departure of the result from an eigendecomposition, relative to the greatest element.
fn departure(matrix: &Matrix3<f64>, eigen: &SymmetricEigen3) -> f64 {
    let scale = matrix.amax().max(f64::MIN_POSITIVE);
    let vectors = Matrix3::from_fn(|row, column| eigen.vectors[column][row]);
    let values = Vector3::from(eigen.values) / scale;
    let residual = ((matrix / scale) * vectors - vectors * Matrix3::from_diagonal(&values)).amax();
    let skew = (vectors.transpose() * vectors - Matrix3::identity()).amax();
    assert!(vectors.determinant() > 0.0, "{eigen:?}");
    assert!(eigen.values.is_sorted_by(|a, b| a >= b), "{eigen:?}");
    residual.max(skew)
}

fn nalgebra_values(matrix: &Matrix3<f64>) -> [f64; 3] {
    let mut values: [f64; 3] = SymmetricEigen::new(*matrix).eigenvalues.into();
    values.sort_by(|a, b| b.total_cmp(a));
    values
}

fn matrix_of(values: [f64; 3], angles: [f64; 3]) -> Matrix3<f64> {
    let rotation = Rotation3::from_euler_angles(angles[0], angles[1], angles[2]);
    let matrix = rotation * Matrix3::from_diagonal(&Vector3::from(values)) * rotation.inverse();
    0.5 * (matrix + matrix.transpose())
}

/// Eigenvalues of any spread: far apart, near each other by 1e-4 to 1e-16, equal, zero, negative.
fn eigenvalues() -> impl Strategy<Value = [f64; 3]> {
    let near = |base: f64, exponents: [i32; 2], signs: [f64; 2]| {
        [base, base + signs[0] * 10f64.powi(-exponents[0]), base + signs[1] * 10f64.powi(-exponents[1])]
    };
    prop_oneof![
        prop::array::uniform3(-1.0..1.0_f64),
        prop::array::uniform3(prop_oneof![Just(0.0), Just(1.0), Just(-1.0), Just(1e-9)]),
        (-1.0..1.0_f64, prop::array::uniform2(0..17_i32), prop::array::uniform2(-1.0..1.0_f64))
            .prop_map(move |(base, exponents, signs)| near(base, exponents, signs)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn decomposes_to_the_last_digits(values in eigenvalues(), angles in prop::array::uniform3(-3.2..3.2_f64)) {
        let matrix = matrix_of(values, angles);
        let eigen = symmetric_eigen3(rows(&matrix)).unwrap();
        prop_assert!(departure(&matrix, &eigen) < 6e-15, "{:e}", departure(&matrix, &eigen));
        for (ours, theirs) in eigen.values.into_iter().zip(nalgebra_values(&matrix)) {
            prop_assert!((ours - theirs).abs() <= 6e-15 * matrix.amax(), "{ours} {theirs}");
        }
    }

    #[test]
    fn scale_is_no_matter(
        values in eigenvalues(),
        angles in prop::array::uniform3(-3.2..3.2_f64),
        exponent in -1000..1000_i32,
    ) {
        let matrix = matrix_of(values, angles);
        let scale = 2f64.powi(exponent);
        let (plain, scaled) = (symmetric_eigen3(rows(&matrix)).unwrap(), symmetric_eigen3(rows(&(matrix * scale))).unwrap());
        // Powers of two change no digit, unless numbers leave the normal range.
        if matrix.iter().all(|x| *x == 0.0 || (x * scale).abs() > 1e-290) {
            prop_assert_eq!(plain.vectors, scaled.vectors);
            for (plain, scaled) in plain.values.into_iter().zip(scaled.values) {
                prop_assert!((plain * scale - scaled).abs() <= 4e-16 * matrix.amax() * scale);
            }
        }
    }

    #[test]
    fn greatest_components_are_positive(matrix in prop::array::uniform3(prop::array::uniform3(-1.0..1.0_f64))) {
        let vectors = symmetric_eigen3(matrix).unwrap().vectors;
        for vector in &vectors[..2] {
            let greatest = vector.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
            prop_assert!(greatest > 0.0);
        }
    }
}

#[test]
fn equal_eigenvalues_give_fixed_axes() {
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for scale in [0.0, 1.0, -7.25, 5e-324, f64::MAX] {
        let eigen = symmetric_eigen3(identity.map(|row| row.map(|x| scale * x))).unwrap();
        assert_eq!(eigen.vectors, identity);
        assert_eq!(eigen.values, [scale; 3]);
    }
    for diagonal in [[2.0, 2.0, 1.0], [1.0, 2.0, 2.0], [2.0, 1.0, 2.0], [0.0, 0.0, 3.0], [3.0, 0.0, 0.0]] {
        let matrix = Matrix3::from_diagonal(&Vector3::from(diagonal));
        let eigen = symmetric_eigen3(rows(&matrix)).unwrap();
        assert!(departure(&matrix, &eigen) < 1e-15, "{eigen:?}");
        assert!(eigen.vectors.iter().flatten().all(|x| x.abs() < 1e-15 || (x.abs() - 1.0).abs() < 1e-15));
    }
}

#[test]
fn the_greatest_numbers_do_not_overflow() {
    let matrix = [[f64::MAX, f64::MAX, 0.0], [f64::MAX, -f64::MAX, 0.0], [0.0, 0.0, 1.0]];
    let eigen = symmetric_eigen3(matrix).unwrap();
    assert!(eigen.vectors.iter().flatten().all(|x| x.is_finite()));
    // The eigenvalue itself is beyond the range of f64.
    assert_eq!([eigen.values[0], eigen.values[2]], [f64::INFINITY, f64::NEG_INFINITY]);
}

#[test]
fn what_is_not_finite_has_no_decomposition() {
    for (bad, [row, column]) in [(f64::NAN, [0, 0]), (f64::INFINITY, [1, 2]), (f64::NEG_INFINITY, [2, 2])] {
        let mut matrix = [[1.0; 3]; 3];
        matrix[row][column] = bad;
        assert_eq!(symmetric_eigen3(matrix), None);
    }
    // The lower triangle is not read.
    let mut matrix = [[1.0; 3]; 3];
    matrix[2][0] = f64::NAN;
    assert!(symmetric_eigen3(matrix).is_some());
}

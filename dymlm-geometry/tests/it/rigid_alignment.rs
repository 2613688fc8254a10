//! The motion between two sets of points.
use dymlm_core::Pose;
use dymlm_geometry::rigid_alignment;
use dymlm_test_support::cases;
use proptest::prelude::*;

/// Computed with numpy 2.4: `U, S, Vt = svd(cov)` of the centred pairs, `R = U diag(1, 1, det U det Vt) Vt`,
/// for pairs that no motion fits exactly.
#[test]
fn alignment_agrees_with_a_known_answer() {
    let in_b = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let in_a = [[1.0, 2.0, 3.0], [1.0, 3.0, 3.0], [0.0, 2.0, 3.0], [1.0, 2.0, 4.1]];
    let found = rigid_alignment(&in_b, &in_a).unwrap();
    let rows = [
        [0.000_177_904_293_125, -0.999_822_095_706_876, -0.018_861_211_158_750],
        [0.999_822_095_706_876, -0.000_177_904_293_125, 0.018_861_211_158_750],
        [-0.018_861_211_158_750, -0.018_861_211_158_750, 0.999_644_191_413_750],
    ];
    for (found, expected) in found.rotation_matrix().iter().flatten().zip(rows.iter().flatten()) {
        assert!((found - expected).abs() < 1e-12);
    }
    for (found, expected) in
        found.translation().iter().zip([1.004_626_350_643_125, 1.995_373_649_356_875, 3.034_519_557_725_937])
    {
        assert!((found - expected).abs() < 1e-12);
    }
}

/// Points and their mirror image: no motion fits them, and the best one is still a motion.
#[test]
fn a_mirror_image_has_the_best_motion() {
    let in_b = [[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 1.0]];
    let in_a = in_b.map(|[x, y, z]| [x, y, -z]);
    let found = rigid_alignment(&in_b, &in_a).unwrap();
    // The weakest direction gives way.
    assert!(found.angle(&Pose::identity()) < 1e-9, "{found:?}");
}

#[test]
fn points_on_a_line_have_no_motion() {
    let line = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [3.0, 3.0, 3.0]];
    assert_eq!(rigid_alignment(&line, &line), None);
    assert_eq!(rigid_alignment(&[[1.0; 3]; 9], &[[1.0; 3]; 9]), None);
    assert_eq!(rigid_alignment(&line[..2], &line[..2]), None);
    assert_eq!(rigid_alignment(&[], &[]), None);
    assert!(rigid_alignment(&[[f64::NAN; 3]; 5], &[[0.0; 3]; 5]).is_none());
}

/// A corridor of 100 m whose way sways by a small share of its length: its turn about itself is known.
#[test]
fn a_long_way_that_sways_a_little_has_a_motion() {
    let a_from_b = Pose::new([40.0, -7.0, 3.0], [0.1, 0.7, -0.1, 0.7]).unwrap();
    for (share, angle) in [(0.1, 1e-9), (5e-4, 1e-9), (2e-5, 1e-6)] {
        let way = |k: i32| {
            let x = 0.1 * f64::from(k);
            let sway = share * 100.0 / 12.0_f64.sqrt() * 2.0_f64.sqrt() * (0.7 * x).sin();
            // Along no axis.
            [x + sway, 0.5 * x - 2.0 * sway, 0.25 * x]
        };
        let in_b: Vec<_> = (0..1000).map(way).collect();
        let in_a: Vec<_> = in_b.iter().map(|&p| a_from_b.transform_point(p)).collect();
        let found = rigid_alignment(&in_b, &in_a).unwrap();
        assert!(found.angle(&a_from_b) < angle, "{share}: {} rad", found.angle(&a_from_b));
        let farthest = in_b.iter().zip(&in_a).map(|(&b, a)| {
            let off = found.transform_point(b);
            (0..3).map(|k| (off[k] - a[k]).powi(2)).sum::<f64>().sqrt()
        });
        assert!(farthest.fold(0.0, f64::max) < 1e-9, "{share}");
    }
}

fn motion() -> impl Strategy<Value = Pose> {
    let quaternion = prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a direction", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.1);
    (prop::array::uniform3(-4.0..4.0_f64), quaternion).prop_map(|(translation, q)| {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        Pose::new(translation, q.map(|x| x / norm)).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(75)))]

    #[test]
    fn finds_every_motion(
        a_from_b in motion(),
        mut in_b in prop::collection::vec(prop::array::uniform3(-0.2..0.2_f64), 6)
    ) {
        // So that they never lie on a line.
        in_b.extend([[0.3, 0.0, 0.0], [0.0, 0.3, 0.0]]);
        let in_a: Vec<_> = in_b.iter().map(|&p| a_from_b.transform_point(p)).collect();
        let found = rigid_alignment(&in_b, &in_a).unwrap();
        prop_assert!(found.distance(&a_from_b) < 1e-7 && found.angle(&a_from_b) < 1e-6);
    }
}

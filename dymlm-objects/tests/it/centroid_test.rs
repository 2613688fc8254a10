//! How often the tests of the centroid reject a true observation, by simulation.

use dymlm_core::SplitMix64;
use dymlm_objects::{CentroidCloud, CentroidTest, CentroidVerdict};
use dymlm_test_support::normal;

/// An observation's centroid: the axes are correlated, and of spreads as different as those of a thing far
/// away.
fn centroid(random: &mut SplitMix64) -> [f64; 3] {
    let [a, b, c] = [0.02, 0.005, 0.001].map(|spread| spread * normal(random));
    [100.0 + a, -30.0 + 0.5 * a + b, 1.0 - 0.3 * a + 0.2 * b + c]
}

/// Share of true observations that a test accepts after `count` of them.
fn acceptance(test: CentroidTest, count: u32, alpha: f64, trials: u32) -> f64 {
    let mut random = SplitMix64::new(count.into());
    let accepted = (0..trials).filter(|_| {
        let mut cloud = CentroidCloud::default();
        (0..count).for_each(|_| cloud.add(centroid(&mut random)));
        test.verdict(&cloud, centroid(&mut random), alpha) == CentroidVerdict::Accepted
    });
    f64::from(accepted.count() as u32) / f64::from(trials)
}

#[test]
fn the_default_rejects_true_observations_with_probability_alpha() {
    // Four deviations of a binomial variable with 5000 trials.
    for alpha in [0.05, 0.01] {
        let tolerance = 4.0 * (alpha * (1.0 - alpha) / 5_000.0_f64).sqrt();
        for count in [4, 6, 30] {
            let rejected = 1.0 - acceptance(CentroidTest::Prediction, count, alpha, 5_000);
            assert!((rejected - alpha).abs() < tolerance, "{count} centroids: {rejected} for {alpha}");
        }
    }
}

#[test]
fn the_papers_rejects_nearly_all_once_an_object_is_well_known() {
    // It asks each of three axes whether the observation is the mean; the axes here are correlated, so that
    // more pass than of independent ones (14 % and 2.5 %).
    let (few, many) = (
        acceptance(CentroidTest::OneSampleT, 9, 0.05, 2000),
        acceptance(CentroidTest::OneSampleT, 30, 0.05, 2000),
    );
    assert!(few < 0.6 && many < 0.3 && many < few, "{few} and {many}");
}

#[test]
fn with_independent_axes_the_papers_accepts_what_the_design_says() {
    let share = |count: u32| {
        let mut random = SplitMix64::new(count.into());
        let accepted = (0..5_000).filter(|_| {
            let mut cloud = CentroidCloud::default();
            (0..count).for_each(|_| cloud.add([(); 3].map(|()| normal(&mut random))));
            let observed = [(); 3].map(|()| normal(&mut random));
            CentroidTest::OneSampleT.verdict(&cloud, observed, 0.05) == CentroidVerdict::Accepted
        });
        accepted.count() as f64 / 5_000.0
    };
    let (at_9, at_30) = (share(9), share(30));
    assert!((at_9 - 0.14).abs() < 0.03, "{at_9}");
    assert!((at_30 - 0.025).abs() < 0.01, "{at_30}");
}

#[test]
fn another_object_is_rejected() {
    let mut random = SplitMix64::new(7);
    let mut cloud = CentroidCloud::default();
    (0..20).for_each(|_| cloud.add(centroid(&mut random)));
    let [x, y, z] = centroid(&mut random);
    for elsewhere in [[x + 0.3, y, z], [x, y + 0.1, z], [x, y, z - 0.05]] {
        assert_eq!(CentroidTest::Prediction.verdict(&cloud, elsewhere, 0.01), CentroidVerdict::Rejected);
    }
}

#[test]
fn nothing_is_decided_by_too_few_or_by_copies() {
    let undecided = |cloud: &CentroidCloud| {
        for test in [CentroidTest::Prediction, CentroidTest::OneSampleT] {
            assert_eq!(test.verdict(cloud, [0.0; 3], 0.05), CentroidVerdict::Undecided);
        }
    };
    let mut cloud = CentroidCloud::default();
    undecided(&cloud);
    for _ in 0..10 {
        cloud.add([1.0, 2.0, 3.0]);
    }
    undecided(&cloud);
    // Centroids on a plane: no spread across it.
    let mut flat = CentroidCloud::default();
    for k in 0..10 {
        flat.add([f64::from(k % 3), f64::from(k % 4), 0.0]);
    }
    assert_eq!(CentroidTest::Prediction.verdict(&flat, [1.0, 1.0, 0.0], 0.05), CentroidVerdict::Undecided);
    assert_eq!(CentroidTest::Prediction.verdict(&cloud, [f64::NAN; 3], 0.05), CentroidVerdict::Undecided);
}

//! Isolation forests against scikit-learn's quality, against the definition of their score, and on degenerate
//! rows.
use dymlm_core::Point;
use dymlm_geometry::{IsolationForest, IsolationForestConfig, IsolationForestScratch, IsolationTrees};
use dymlm_test_support::{cases, recording};
use proptest::prelude::*;

fn forest(trees: usize, sample_size: usize, seed: u64) -> IsolationForest {
    let mut config = IsolationForestConfig::default();
    (config.trees, config.sample_size, config.seed) = (trees, sample_size, seed);
    IsolationForest::new(config).unwrap()
}

/// Area under the ROC curve: how often an outlier scores above an inlier, ties counting half.
fn area_under_curve(scores: &[f64], outlier: &[bool]) -> f64 {
    let of = |wanted: bool| {
        scores.iter().zip(outlier).filter(move |(_, is)| **is == wanted).map(|(score, _)| *score)
    };
    let wins: f64 = of(true)
        .flat_map(|high| {
            of(false).map(move |low| {
                if high > low {
                    1.0
                } else if high == low {
                    0.5
                } else {
                    0.0
                }
            })
        })
        .sum();
    wins / (of(true).count() * of(false).count()) as f64
}

fn mean_area<const D: usize>(rows: &[[f32; D]], outlier: &[bool]) -> f64 {
    let seeds = 40;
    let areas =
        (0..seeds).map(|seed| area_under_curve(&forest(100, 256, seed).fit(rows).scores(rows), outlier));
    areas.sum::<f64>() / seeds as f64
}

/// `tests/data/isolation_forest.py` makes the same rows.
fn synthetic_rows() -> (Vec<[f32; 4]>, Vec<bool>) {
    let mut state = 12345_u64;
    let mut next = || {
        state = (state * 1_103_515_245 + 12345) % (1 << 31);
        state as f64 / f64::from(1_u32 << 31)
    };
    let rows = (0..1000).map(|row| {
        let scale = if row < 100 { 2.0 } else { 1.0 };
        std::array::from_fn(|_| (((0..4).map(|_| next()).sum::<f64>() - 2.0) * scale) as f32)
    });
    (rows.collect(), (0..1000).map(|row| row < 100).collect())
}

fn recorded_rows<const D: usize>(name: &str) -> Option<(Vec<[f32; D]>, Vec<bool>)> {
    let text = std::fs::read_to_string(recording(&format!("outliers/{name}"))?).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let numbers: Vec<f32> = line.split(',').map(|number| number.parse().unwrap()).collect();
        let (label, row) = numbers.split_last().unwrap();
        (<[f32; D]>::try_from(row).unwrap(), *label == 1.0)
    });
    Some(rows.unzip())
}

/// Means over 100 seeds, and their spread over single seeds, as `tests/data/isolation_forest.py` prints them.
#[test]
fn synthetic_outliers_are_found_as_by_scikit_learn() {
    let (rows, outlier) = synthetic_rows();
    let area = mean_area(&rows, &outlier);
    assert!((area - 0.887_30).abs() < 0.01, "{area}");
}

#[test]
fn recorded_outliers_are_found_as_by_scikit_learn() {
    fn check<const D: usize>(name: &str, expected: f64) {
        if let Some((rows, outlier)) = recorded_rows::<D>(name) {
            let area = mean_area(&rows, &outlier);
            println!("{name}: ROC-AUC {area:.4}, scikit-learn's {expected:.4}");
            assert!((area - expected).abs() < 0.01, "{name}: {area}");
        }
    }
    check::<21>("cardio.csv", 0.924_86);
    check::<9>("glass.csv", 0.699_02);
    check::<30>("wbc.csv", 0.938_01);
}

fn rows() -> impl Strategy<Value = Vec<Point>> {
    let spread = prop::array::uniform3(-1.0..1.0_f32);
    let lattice = prop::array::uniform3(-2..3_i8).prop_map(|p| p.map(f32::from));
    let plane = prop::array::uniform2(-1.0..1.0_f32).prop_map(|[x, y]| [x, 0.7, y]);
    let any = prop_oneof![spread.clone(), lattice.clone(), plane.clone()];
    prop_oneof![
        prop::collection::vec(spread, 1..600),
        prop::collection::vec(lattice, 1..600),
        prop::collection::vec(plane, 1..600),
        prop::collection::vec(any, 1..5000),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(15)))]

    #[test]
    fn a_batch_scores_as_row_by_row(rows in rows(), seed in any::<u64>(), trees in 1..40_usize, sample in 2..400_usize) {
        let trees = forest(trees, sample, seed).fit(&rows);
        let scores = trees.scores(&rows);
        for (row, score) in rows.iter().zip(&scores) {
            prop_assert_eq!(trees.score(row).to_bits(), score.to_bits());
            prop_assert!((0.0..=1.0).contains(score));
        }
        // A row's score depends neither on the order of the rows nor on the other rows.
        let reversed: Vec<Point> = rows.iter().rev().copied().collect();
        let mut back = trees.scores(&reversed);
        back.reverse();
        prop_assert_eq!(&back, &scores);
        let part = &rows[rows.len() / 3..];
        prop_assert_eq!(&trees.scores(part), &scores[rows.len() / 3..]);
    }

    #[test]
    fn old_buffers_do_not_matter(clouds in prop::collection::vec(rows(), 2..4), sample in 2..300_usize) {
        let forest = forest(10, sample, 3);
        let (mut scratch, mut trees, mut scores) = (IsolationForestScratch::default(), IsolationTrees::default(), Vec::new());
        for rows in &clouds {
            forest.fit_into(rows, &mut scratch, &mut trees);
            prop_assert_eq!(&trees, &forest.fit(rows));
            trees.scores_into(rows, &mut scores);
            prop_assert_eq!(&scores, &trees.scores(rows));
        }
    }

    #[test]
    fn rows_that_are_no_numbers_are_outliers_and_not_drawn(
        rows in rows(),
        holes in prop::collection::vec((0..600_usize, 0..3_usize, 0..3_usize), 1..9),
    ) {
        let mut all: Vec<(Point, bool)> = rows.iter().map(|row| (*row, true)).collect();
        for (place, axis, kind) in holes {
            let mut hole = [0.1; 3];
            hole[axis] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][kind];
            all.insert(place.min(all.len()), (hole, false));
        }
        let with_holes: Vec<Point> = all.iter().map(|(row, _)| *row).collect();
        let trees = forest(20, 64, 1).fit(&with_holes);
        prop_assert_eq!(&trees, &forest(20, 64, 1).fit(&rows));
        for ((row, finite), score) in all.iter().zip(trees.scores(&with_holes)) {
            prop_assert_eq!(score, if *finite { trees.score(row) } else { 1.0 });
        }
    }

    /// Cuts are drawn between the rows' least and greatest numbers, so scores do not depend on the units.
    #[test]
    fn scale_and_offset_are_no_matter(rows in prop::collection::vec(prop::array::uniform3(-8..8_i8), 2..300), exponent in -20..20_i32) {
        let plain: Vec<Point> = rows.iter().map(|row| row.map(f32::from)).collect();
        let scaled: Vec<Point> = plain.iter().map(|row| row.map(|x| x * 2f32.powi(exponent))).collect();
        let forest = forest(20, 64, 5);
        prop_assert_eq!(forest.fit(&plain).scores(&plain), forest.fit(&scaled).scores(&scaled));
    }
}

/// Two rows are always separated by the first cut: path 1 = c(2), score 1/2. Of three rows on a line, the far
/// one is cut off first with a probability known in closed form.
#[test]
fn path_lengths_of_small_samples_are_those_of_the_definition() {
    let trees = forest(50, 2, 0).fit(&[[0.0], [1.0]]);
    assert_eq!(trees.scores(&[[0.0], [1.0], [0.5]]), [0.5; 3]);

    // Height limit 2; the first cut falls with probability 9/10 between 1 and 10. The far row's path is 1
    // then, else 2; a near row's is 2 or, cut off first, 1. c(3) = 1.2074.
    let trees = forest(10_000, 3, 0).fit(&[[0.0], [1.0], [10.0]]);
    // c, like the paths, is kept as an f32.
    let normal = f64::from((2.0 * (2f64.ln() + 0.577_215_664_901_532_9) - 4.0 / 3.0) as f32);
    let mean_path = |score: f64| -score.log2() * normal;
    let [near, middle, far] = [[0.0], [1.0], [10.0]].map(|row| mean_path(trees.score(&row)));
    assert!((far - 1.1).abs() < 0.01 && (near - 1.9).abs() < 0.01, "{far} {near}");
    assert!((middle - 2.0).abs() < 1e-12, "{middle}");
}

#[test]
fn strays_stand_out_of_a_thing() {
    // A crust of 20 cm about the origin, and every 100th point at 40 to 60 cm.
    let points: Vec<Point> = (0..3000)
        .map(|i| {
            let turns = f64::from(i) * 0.618_033_988_75;
            let z = 2.0 * (f64::from(i) + 0.5) / 3000.0 - 1.0;
            let (sin, cos) = (turns * std::f64::consts::TAU).sin_cos();
            let (flat, radius) =
                ((1.0 - z * z).sqrt(), if i % 100 == 7 { 0.4 + 0.1 * (turns % 2.0) } else { 0.2 });
            [radius * flat * cos, radius * flat * sin, radius * z].map(|x| x as f32)
        })
        .collect();
    let stray: Vec<bool> = (0..3000).map(|i| i % 100 == 7).collect();
    let forest = forest(100, 256, 0);
    let area = area_under_curve(&forest.fit(&points).scores(&points), &stray);
    assert!(area > 0.99, "{area}");
    let inliers = forest.inliers(&points);
    let (kept, strays_kept) = (inliers.len(), inliers.iter().filter(|i| stray[**i]).count());
    assert!(kept > 2900 && strays_kept < 15, "{kept} {strays_kept}");
    assert!(inliers.is_sorted());
}

#[test]
fn seeds_make_trees() {
    let (rows, _) = synthetic_rows();
    assert_eq!(forest(10, 64, 1).fit(&rows), forest(10, 64, 1).fit(&rows));
    assert_ne!(forest(10, 64, 1).fit(&rows), forest(10, 64, 2).fit(&rows));
}

#[test]
fn degenerate_rows_have_plain_scores() {
    let forest = forest(20, 256, 0);
    let none: [Point; 0] = [];
    assert_eq!(forest.fit(&none).scores(&[[1.0, 2.0, 3.0], [f32::NAN; 3]]), [0.5, 1.0]);
    assert_eq!(IsolationTrees::<3>::default().scores(&[[1.0; 3], [f32::INFINITY; 3]]), [0.5, 1.0]);
    assert_eq!(forest.fit(&[[f32::NAN; 3]; 10]).scores(&[[1.0; 3]]), [0.5]);
    assert!(forest.inliers(&none).is_empty());
    for count in [1, 2, 7, 300, 1000] {
        let same = vec![[1.0_f32, 2.0, 3.0]; count];
        let scores = forest.fit(&same).scores(&same);
        assert!(scores.iter().all(|&score| score == 0.5), "{count}: {}", scores[0]);
        assert_eq!(forest.inliers(&same).len(), count);
    }
    // No columns at all.
    assert_eq!(forest.fit(&[[0.0_f32; 0]; 3]).scores(&[[]]).len(), 1);
    // The whole range of f32, and neighbouring numbers.
    let extremes = [[f32::MAX], [-f32::MAX], [0.0], [1.0], [1.0 + f32::EPSILON], [f32::MIN_POSITIVE]];
    assert!(forest.fit(&extremes).scores(&extremes).iter().all(|score| (0.0..1.0).contains(score)));
}

#[test]
fn refuses_settings_out_of_range() {
    let refused = |change: fn(&mut IsolationForestConfig)| {
        let mut config = IsolationForestConfig::default();
        change(&mut config);
        IsolationForest::new(config).unwrap_err().field
    };
    assert_eq!(refused(|config| config.trees = 0), "isolation_forest.trees");
    assert_eq!(refused(|config| config.trees = 10_001), "isolation_forest.trees");
    assert_eq!(refused(|config| config.sample_size = 1), "isolation_forest.sample_size");
    assert_eq!(refused(|config| config.sample_size = 65_537), "isolation_forest.sample_size");
    assert_eq!(refused(|config| config.threshold = f64::NAN), "isolation_forest.threshold");
    assert_eq!(refused(|config| config.threshold = 1.01), "isolation_forest.threshold");
}

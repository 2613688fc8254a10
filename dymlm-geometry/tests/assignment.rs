//! `Assignment`: against all matchings, and against `SciPy`.

#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_geometry::Assignment;
use proptest::prelude::*;

/// Tries every partial matching.
fn best(weights: &[Vec<i64>], row: usize, used: u32) -> i64 {
    let Some(values) = weights.get(row) else { return 0 };
    let free = values.iter().enumerate().filter(|&(column, _)| used & (1 << column) == 0);
    let with = free.map(|(column, value)| value + best(weights, row + 1, used | 1 << column)).max();
    best(weights, row + 1, used).max(with.unwrap_or(0))
}

/// The sum of the pairs; no pair is worthless and no column has two rows.
fn total(weights: &[Vec<i64>], partners: &[Option<usize>]) -> i64 {
    let mut seen = std::collections::BTreeSet::new();
    let worth = |(row, column): (usize, &Option<usize>)| {
        column.map_or(0, |column| {
            assert!(weights[row][column] > 0 && seen.insert(column));
            weights[row][column]
        })
    };
    partners.iter().enumerate().map(worth).sum()
}

proptest! {
    #[test]
    fn the_sum_is_that_of_the_best_of_all_matchings(
        sizes in proptest::collection::vec((0_usize..7, 0_usize..7), 1..4),
        values in proptest::collection::vec(-3_i64..9, 49),
    ) {
        let mut assignment = Assignment::default();
        for (rows, columns) in sizes {
            let weights: Vec<Vec<i64>> =
                (0..rows).map(|row| values[7 * row..7 * row + columns].to_vec()).collect();
            let partners = assignment.solve(rows, columns, |row, column| weights[row][column]);
            prop_assert_eq!(partners.len(), rows);
            prop_assert_eq!(total(&weights, partners), best(&weights, 0, 0));
        }
    }
}

#[test]
fn sixty_rows_and_fortyfive_columns_have_scipys_sum() {
    // numpy 2: x = (i * 7919 + j * 104729) * 2654435761 % 2**32 % 1000 for i < 60, j < 45;
    // scipy 1.17 linear_sum_assignment(x, maximize=True) has the sum below.
    let weight = |i: usize, j: usize| {
        ((((i as u64 * 7919 + j as u64 * 104_729) * 2_654_435_761) % (1 << 32)) % 1000) as i64
    };
    let mut assignment = Assignment::default();
    let weights: Vec<Vec<i64>> = (0..60).map(|i| (0..45).map(|j| weight(i, j)).collect()).collect();
    assert_eq!(total(&weights, assignment.solve(60, 45, weight)), SCIPY_SUM);
    let transposed: Vec<Vec<i64>> = (0..45).map(|j| (0..60).map(|i| weight(i, j)).collect()).collect();
    assert_eq!(total(&transposed, assignment.solve(45, 60, |j, i| weight(i, j))), SCIPY_SUM);
}

const SCIPY_SUM: i64 = 44_325;

#[test]
fn nothing_to_assign_and_extreme_weights_are_harmless() {
    let mut assignment = Assignment::default();
    assert_eq!(assignment.solve(0, 5, |_, _| 1), []);
    assert_eq!(assignment.solve(2, 0, |_, _| 1), [None, None]);
    assert_eq!(assignment.solve(1, 2, |_, _| i64::MIN), [None]);
    assert_eq!(assignment.solve(2, 1, |_, _| i64::MAX), [Some(0), None]);
}

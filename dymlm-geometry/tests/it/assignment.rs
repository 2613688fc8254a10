//! `Assignment`: against all matchings, and against `SciPy`.

use dymlm_geometry::Assignment;
use dymlm_test_support::cases;
use proptest::prelude::*;

/// Tries every partial matching.
fn best(weights: &[Vec<i64>], row: usize, used: u32) -> i64 {
    let Some(values) = weights.get(row) else { return 0 };
    let free = values.iter().enumerate().filter(|&(column, _)| used & (1 << column) == 0);
    let with = free.map(|(column, value)| value + best(weights, row + 1, used | 1 << column)).max();
    best(weights, row + 1, used).max(with.unwrap_or(0))
}

/// The sum of the pairs' weights; checks that no pair has weight 0 and no column has two rows.
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

/// The plain algorithm: columns one by one, with the column before each noted. Its order decides which of
/// several best choices wins, and this must stay.
fn plain(rows: usize, columns: usize, weight: &dyn Fn(usize, usize) -> i64) -> Vec<Option<usize>> {
    let transposed = rows > columns;
    let (few, many) = if transposed { (columns, rows) } else { (rows, columns) };
    let cost = |a: usize, b: usize| -(if transposed { weight(b, a) } else { weight(a, b) }).max(0);
    let (mut row_potentials, mut column_potentials) = (vec![0; few], vec![0; many]);
    let mut row_of: Vec<Option<usize>> = vec![None; many];
    for first in 0..few {
        let (mut distance, mut from) = (vec![i64::MAX; many], vec![None; many]);
        let (mut open, mut reached): (Vec<usize>, Vec<usize>) = ((0..many).collect(), Vec::new());
        let (mut row, mut via, mut length) = (first, None, 0);
        loop {
            let (mut shortest, mut place, mut ends) = (i64::MAX, 0, false);
            for (at, &column) in open.iter().enumerate() {
                let through = length + cost(row, column) - row_potentials[row] - column_potentials[column];
                if through < distance[column] {
                    (distance[column], from[column]) = (through, via);
                }
                let is_free = row_of[column].is_none();
                if distance[column] < shortest || (distance[column] == shortest && is_free && !ends) {
                    (shortest, place, ends) = (distance[column], at, is_free);
                }
            }
            let column = open.swap_remove(place);
            reached.push(column);
            (via, length) = (Some(column), shortest);
            let Some(next) = row_of[column] else { break };
            row = next;
        }
        row_potentials[first] += length;
        for &column in &reached {
            if let Some(row) = row_of[column] {
                row_potentials[row] += length - distance[column];
                column_potentials[column] -= length - distance[column];
            }
        }
        let mut at = via;
        while let Some(column) = at {
            at = from[column];
            row_of[column] = at.map_or(Some(first), |before| row_of[before]);
        }
    }
    let mut partners = vec![None; rows];
    for (column, row) in row_of.into_iter().enumerate() {
        if let Some(row) = row.filter(|&row| cost(row, column) < 0) {
            let (row, column) = if transposed { (column, row) } else { (row, column) };
            partners[row] = Some(column);
        }
    }
    partners
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(100)))]

    /// Few different weights, so that most sums are equal; at any scale, of which the greatest need integers.
    #[test]
    fn of_equal_sums_the_same_one_wins_as_ever(
        sizes in proptest::collection::vec((0_usize..40, 0_usize..40), 1..4),
        values in proptest::collection::vec(-1_i64..4, 1600),
        scale in prop_oneof![Just(1_i64), Just(1 << 40)],
    ) {
        let mut assignment = Assignment::default();
        for (rows, columns) in sizes {
            let weight = |row: usize, column: usize| scale * values[40 * row + column];
            prop_assert_eq!(assignment.solve(rows, columns, weight), plain(rows, columns, &weight));
        }
    }
}

#[test]
fn large_weights_of_many_pairs_are_exact() {
    let random =
        |i: usize, j: usize| ((i as u64 * 7919 + j as u64 * 104_729) * 2_654_435_761 % (1 << 32)) as i64;
    let (mut small, mut large) = (Assignment::default(), Assignment::default());
    for size in [255, 256, 300] {
        // Single units decide between sums that are equal in f64.
        let weight = |i: usize, j: usize| Assignment::MAX_WEIGHT - random(i, j) % 1000;
        let expected = small.solve(size, size, |i, j| 1000 - random(i, j) % 1000).to_vec();
        assert_eq!(large.solve(size, size, weight), expected);
    }
}

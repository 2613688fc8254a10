use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// `IoU` in fixed point: sums of assignments compare exactly, on every machine.
const ONE: f64 = (1_u64 << 40) as f64;

/// Chosen pairs, as many as rows.
pub(super) type Matches = Vec<Option<usize>>;

/// Pairs rows with columns so that the sum of `iou` over pairs is greatest; only pairs of at least `min_iou` count,
/// and none else is made. `iou` is row-major and within 0..=1. Answers the column of each row.
///
/// Kuhn-Munkres, O(n^3); when no row or column has a choice, which is the common case, O(n^2).
pub(super) fn assign(iou: &[f64], columns: usize, min_iou: f64, matches: &mut Matches) {
    matches.clear();
    if columns == 0 {
        return;
    }
    let rows = iou.len() / columns;
    matches.resize(rows, None);
    if !assign_without_conflict(iou, columns, min_iou, matches) {
        assign_optimally(iou, columns, min_iou, matches);
    }
}

/// Takes every allowed pair, if no two of them share a row or a column.
fn assign_without_conflict(iou: &[f64], columns: usize, min_iou: f64, matches: &mut Matches) -> bool {
    for (row, values) in iou.chunks_exact(columns).enumerate() {
        for (column, _) in values.iter().enumerate().filter(|&(_, &value)| allowed(value, min_iou)) {
            if matches.contains(&Some(column)) || matches[row].is_some() {
                matches.fill(None);
                return false;
            }
            matches[row] = Some(column);
        }
    }
    true
}

fn assign_optimally(iou: &[f64], columns: usize, min_iou: f64, matches: &mut Matches) {
    let rows = matches.len();
    // A forbidden pair weighs as much as no pair, so it never keeps an allowed one from being made.
    let weight = |row: usize, column: usize| {
        let value = iou[row * columns + column];
        if allowed(value, min_iou) { (value * ONE).round() as i64 } else { 0 }
    };
    // The solver wants no more rows than columns.
    if rows <= columns {
        let weights = Matrix::from_fn(rows, columns, |(row, column)| weight(row, column));
        for (row, column) in kuhn_munkres(&weights).1.into_iter().enumerate() {
            matches[row] = allowed(iou[row * columns + column], min_iou).then_some(column);
        }
    } else {
        let weights = Matrix::from_fn(columns, rows, |(column, row)| weight(row, column));
        for (column, row) in kuhn_munkres(&weights).1.into_iter().enumerate() {
            if allowed(iou[row * columns + column], min_iou) {
                matches[row] = Some(column);
            }
        }
    }
}

/// Boxes that share nothing are never one object, whatever the gate.
fn allowed(iou: f64, min_iou: f64) -> bool {
    iou > 0.0 && iou >= min_iou
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn total(iou: &[f64], columns: usize, matches: &[Option<usize>]) -> f64 {
        matches.iter().enumerate().filter_map(|(row, column)| column.map(|c| iou[row * columns + c])).sum()
    }

    /// Tries every partial matching.
    fn brute_force(iou: &[f64], columns: usize, min_iou: f64, row: usize, used: u32) -> f64 {
        if row * columns >= iou.len() {
            return 0.0;
        }
        let mut best = brute_force(iou, columns, min_iou, row + 1, used);
        for column in 0..columns {
            let value = iou[row * columns + column];
            if used & (1 << column) == 0 && allowed(value, min_iou) {
                let rest = brute_force(iou, columns, min_iou, row + 1, used | (1 << column));
                best = best.max(value + rest);
            }
        }
        best
    }

    proptest! {
        #[test]
        fn is_as_good_as_the_best_of_all(
            columns in 1_usize..6,
            values in proptest::collection::vec(0.0_f64..1.0, 0..30),
            min_iou in 0.0_f64..0.9,
        ) {
            let iou = &values[..values.len() / columns * columns];
            let mut matches = Matches::new();
            assign(iou, columns, min_iou, &mut matches);
            prop_assert_eq!(matches.len(), iou.len() / columns);
            let mut taken: Vec<_> = matches.iter().flatten().collect();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), matches.iter().flatten().count());
            for (row, column) in matches.iter().enumerate() {
                prop_assert!(column.is_none_or(|c| iou[row * columns + c] >= min_iou));
            }
            let best = brute_force(iou, columns, min_iou, 0, 0);
            prop_assert!((total(iou, columns, &matches) - best).abs() < 1e-9);
        }
    }

    #[test]
    fn a_forbidden_pair_does_not_displace_an_allowed_one() {
        // Without the gate the best sum is 0.29 + 0.75 over 0.7 + 0; with it only one pair can be made.
        let iou = [0.7, 0.29, 0.75, 0.0];
        let mut matches = Matches::new();
        assign(&iou, 2, 0.3, &mut matches);
        assert_eq!(matches, [None, Some(0)]);
    }

    #[test]
    fn nothing_to_pair() {
        let mut matches = vec![Some(3)];
        assign(&[], 0, 0.3, &mut matches);
        assert!(matches.is_empty());
        assign(&[0.0, 0.0], 1, 0.0, &mut matches);
        assert_eq!(matches, [None, None]);
    }
}

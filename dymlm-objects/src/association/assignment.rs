use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// Values in fixed point: sums of assignments compare exactly, on every machine.
const ONE: f64 = (1_u64 << 40) as f64;

/// Pairs rows with columns so that the sum of values over pairs is greatest; pairs of value 0 or less are not made.
/// `values` is row-major. Answers the column of each row. Kuhn-Munkres, O(n^3).
pub(super) fn assign(values: &[f64], columns: usize, matches: &mut Vec<Option<usize>>) {
    matches.clear();
    if columns == 0 {
        return;
    }
    let rows = values.len() / columns;
    matches.resize(rows, None);
    let weight = |row: usize, column: usize| (values[row * columns + column].max(0.0) * ONE).round() as i64;
    // The solver wants no more rows than columns.
    if rows <= columns {
        let weights = Matrix::from_fn(rows, columns, |(row, column)| weight(row, column));
        for (row, column) in kuhn_munkres(&weights).1.into_iter().enumerate() {
            matches[row] = (weight(row, column) > 0).then_some(column);
        }
    } else {
        let weights = Matrix::from_fn(columns, rows, |(column, row)| weight(row, column));
        for (column, row) in kuhn_munkres(&weights).1.into_iter().enumerate() {
            if weight(row, column) > 0 {
                matches[row] = Some(column);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Tries every partial matching.
    fn brute_force(values: &[f64], columns: usize, row: usize, used: u32) -> f64 {
        if row * columns >= values.len() {
            return 0.0;
        }
        let mut best = brute_force(values, columns, row + 1, used);
        for column in 0..columns {
            let value = values[row * columns + column];
            if used & (1 << column) == 0 && value > 0.0 {
                best = best.max(value + brute_force(values, columns, row + 1, used | (1 << column)));
            }
        }
        best
    }

    proptest! {
        #[test]
        fn is_as_good_as_the_best_of_all(columns in 1_usize..6, values in prop::collection::vec(-1.0_f64..1.0, 0..30)) {
            let values = &values[..values.len() / columns * columns];
            let mut matches = Vec::new();
            assign(values, columns, &mut matches);
            let mut taken: Vec<_> = matches.iter().flatten().collect();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), matches.iter().flatten().count());
            let pairs = || matches.iter().enumerate().filter_map(|(row, column)| column.map(|c| values[row * columns + c]));
            prop_assert!(pairs().all(|value| value > 0.0));
            prop_assert!((pairs().sum::<f64>() - brute_force(values, columns, 0, 0)).abs() < 1e-9);
        }
    }

    #[test]
    fn nothing_to_pair() {
        let mut matches = vec![Some(3)];
        assign(&[], 0, &mut matches);
        assert!(matches.is_empty());
        assign(&[0.0, -1.0], 1, &mut matches);
        assert_eq!(matches, [None, None]);
    }
}

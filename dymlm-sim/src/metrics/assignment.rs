use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// Pairs rows with columns so that the sum of the pairs' weights is greatest; only pairs of positive weight are made.
/// Answers (row, column), by ascending row.
///
/// Kuhn-Munkres, O(n m^2) for n <= m.
pub(super) fn assign(
    rows: usize,
    columns: usize,
    weight: impl Fn(usize, usize) -> i64,
) -> Vec<(usize, usize)> {
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    // The solver wants no more rows than columns.
    let mut pairs: Vec<(usize, usize)> = if rows <= columns {
        let weights = Matrix::from_fn(rows, columns, |(row, column)| weight(row, column));
        kuhn_munkres(&weights).1.into_iter().enumerate().collect()
    } else {
        let weights = Matrix::from_fn(columns, rows, |(column, row)| weight(row, column));
        kuhn_munkres(&weights).1.into_iter().enumerate().map(|(column, row)| (row, column)).collect()
    };
    pairs.retain(|&(row, column)| weight(row, column) > 0);
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Tries every partial matching.
    fn best(weights: &[Vec<i64>], row: usize, used: u32) -> i64 {
        let Some(values) = weights.get(row) else { return 0 };
        let free = values.iter().enumerate().filter(|&(column, _)| used & (1 << column) == 0);
        let with = free.map(|(column, value)| value + best(weights, row + 1, used | 1 << column)).max();
        best(weights, row + 1, used).max(with.unwrap_or(0))
    }

    proptest! {
        #[test]
        fn is_as_good_as_the_best_of_all(
            rows in 0_usize..6,
            columns in 0_usize..6,
            values in proptest::collection::vec(-3_i64..9, 36),
        ) {
            let weights: Vec<Vec<i64>> = (0..rows).map(|row| values[6 * row..6 * row + columns].to_vec()).collect();
            // A weight below 0 is no pair, like 0.
            let pairs = assign(rows, columns, |row, column| weights[row][column].max(0));
            let mut seen = [0_u32; 2];
            for &(row, column) in &pairs {
                prop_assert!(weights[row][column] > 0 && seen[0] & 1 << row == 0 && seen[1] & 1 << column == 0);
                seen = [seen[0] | 1 << row, seen[1] | 1 << column];
            }
            let total: i64 = pairs.iter().map(|&(row, column)| weights[row][column]).sum();
            prop_assert_eq!(total, best(&weights, 0, 0));
        }
    }
}

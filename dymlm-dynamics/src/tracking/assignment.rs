use dymlm_geometry::Assignment;

/// The integer that stands for an `IoU` of 1: in fixed point the sums of assignments compare exactly, on
/// every machine.
const ONE: u64 = 1 << 40;

/// Pairs rows with columns so that the sum of `iou` over the pairs is greatest; pairs below `min_iou` are not
/// made. `iou` is row-major and within 0..=1. Returns the column of each row.
pub(super) fn pair_by_iou<'a>(
    assignment: &'a mut Assignment,
    iou: &[f64],
    columns: usize,
    min_iou: f64,
) -> &'a [Option<usize>] {
    let rows = iou.len().checked_div(columns).unwrap_or(0);
    // A forbidden pair has the weight of no pair, so it never keeps an allowed pair from being made.
    assignment.solve(rows, columns, |row, column| {
        let value = iou[row * columns + column];
        if allowed(value, min_iou) { ((value * ONE as f64).round() as i64).max(1) } else { 0 }
    })
}

/// Boxes that do not overlap are never one object, even if `min_iou` is 0.
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
            let mut assignment = Assignment::default();
            let matches = pair_by_iou(&mut assignment, iou, columns, min_iou);
            prop_assert_eq!(matches.len(), iou.len() / columns);
            let mut taken: Vec<_> = matches.iter().flatten().collect();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), matches.iter().flatten().count());
            for (row, column) in matches.iter().enumerate() {
                prop_assert!(column.is_none_or(|c| iou[row * columns + c] >= min_iou));
            }
            let best = brute_force(iou, columns, min_iou, 0, 0);
            prop_assert!((total(iou, columns, matches) - best).abs() < 1e-9);
        }
    }

    #[test]
    fn a_forbidden_pair_does_not_displace_an_allowed_one() {
        // Without the gate the best sum is 0.29 + 0.75 over 0.7 + 0; with it only one pair can be made.
        let iou = [0.7, 0.29, 0.75, 0.0];
        assert_eq!(pair_by_iou(&mut Assignment::default(), &iou, 2, 0.3), [None, Some(0)]);
    }

    #[test]
    fn nothing_to_pair() {
        let mut assignment = Assignment::default();
        assert_eq!(pair_by_iou(&mut assignment, &[], 0, 0.3), []);
        assert_eq!(pair_by_iou(&mut assignment, &[0.0, 0.0], 1, 0.0), [None, None]);
    }
}

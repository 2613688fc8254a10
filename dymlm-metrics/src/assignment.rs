use dymlm_geometry::Assignment;

/// Fixed-point weight of an intersection over union of 1: sums of integers compare exactly on every machine.
pub(crate) const ONE: i64 = 1 << 32;

/// Pairs rows with columns so that the sum of the pairs' weights is greatest; only pairs of positive weight
/// are made. Returns (row, column) by ascending row.
pub(crate) fn assign(
    rows: usize,
    columns: usize,
    weight: impl Fn(usize, usize) -> i64,
) -> Vec<(usize, usize)> {
    let mut assignment = Assignment::default();
    let partners = assignment.solve(rows, columns, weight).iter().enumerate();
    partners.filter_map(|(row, column)| Some((row, (*column)?))).collect()
}

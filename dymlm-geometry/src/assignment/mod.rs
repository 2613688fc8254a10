mod length;
mod shortest_paths;

use length::Length;
use shortest_paths::ShortestPaths;

/// Pairs rows with columns so that the sum of the pairs' weights is greatest (the linear sum assignment
/// problem; rows and columns may stay unpaired): boxes with tracks, detections with objects.
///
/// Successive shortest augmenting paths with potentials (Kuhn 1955, Munkres 1957; in the form of Jonker and
/// Volgenant, "A Shortest Augmenting Path Algorithm for Dense and Sparse Linear Assignment Problems", 1987,
/// without their heuristics, which would choose differently among equal sums): O(n^2 m) for n <= m. Weights
/// are integers, so that sums compare exactly on every machine; real weights are passed as fixed-point
/// numbers. The buffers are kept for the next call.
///
/// ```
/// use dymlm_geometry::Assignment;
///
/// // Two detections, three tracks. The pair of greatest weight would leave the other detection unpaired.
/// let weights = [80, 70, 0,
///                75,  0, 0];
/// let mut assignment = Assignment::default();
/// assert_eq!(assignment.solve(2, 3, |row, column| weights[3 * row + column]), [Some(1), Some(0)]);
/// ```
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Used as long as its sums are exact: it runs in vector registers.
    floating: ShortestPaths<f64>,
    integer: ShortestPaths<i64>,
    partners: Vec<Option<usize>>,
}

impl Assignment {
    /// Largest weight; larger weights count as this one. Sums over a million pairs stay exact.
    pub const MAX_WEIGHT: i64 = 1 << 42;

    /// The column of each row, or `None`. Only pairs of positive weight are made; of several best choices
    /// always the same one is taken.
    pub fn solve(
        &mut self,
        rows: usize,
        columns: usize,
        weight: impl Fn(usize, usize) -> i64,
    ) -> &[Option<usize>] {
        self.partners.clear();
        self.partners.resize(rows, None);
        if rows == 0 || columns == 0 {
            return &self.partners;
        }

        // Rows are added one by one: the smaller side becomes the rows.
        let transposed = rows > columns;
        let (few, many) = if transposed { (columns, rows) } else { (rows, columns) };
        let weight_of = |a: usize, b: usize| {
            let weight = if transposed { weight(b, a) } else { weight(a, b) };
            weight.clamp(0, Self::MAX_WEIGHT)
        };
        let greatest = self.floating.prepare(few, many, weight_of);
        let row_of = if <f64 as Length>::holds(few, greatest) {
            self.floating.pair()
        } else {
            self.integer.prepare(few, many, weight_of);
            self.integer.pair()
        };
        for (column, row) in row_of.iter().enumerate() {
            if let Some(row) = row.filter(|&row| weight_of(row, column) > 0) {
                let (row, column) = if transposed { (column, row) } else { (row, column) };
                self.partners[row] = Some(column);
            }
        }
        &self.partners
    }
}

/// Pairs rows with columns so that the sum of the pairs' weights is greatest (the linear sum assignment
/// problem, of which a part may stay unpaired): boxes with tracks, detections with objects.
///
/// Successive shortest augmenting paths with potentials (Kuhn 1955, Munkres 1957; in the form of Jonker and
/// Volgenant, "A Shortest Augmenting Path Algorithm for Dense and Sparse Linear Assignment Problems", 1987,
/// without their heuristics): O(n^2 m) for n <= m. Weights are integers, so that sums compare exactly on
/// every machine; real weights come as fixed point. The buffers stay for the next call.
///
/// ```
/// use dymlm_geometry::Assignment;
///
/// // Two detections, three tracks. The best pair of all would cost the other detection its only one.
/// let weights = [80, 70, 0,
///                75,  0, 0];
/// let mut assignment = Assignment::default();
/// assert_eq!(assignment.solve(2, 3, |row, column| weights[3 * row + column]), [Some(1), Some(0)]);
/// ```
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Costs of the side with fewer members against the other, row by row.
    costs: Vec<i64>,
    row_potentials: Vec<i64>,
    column_potentials: Vec<i64>,
    /// The row that each column is paired with; the place after the last column holds the row being added.
    row_of: Vec<usize>,
    /// Length of the shortest path to each column, and the column before it on that path.
    distance: Vec<i64>,
    previous: Vec<usize>,
    /// Columns that have been reached, and those that have not, in any order.
    reached: Vec<usize>,
    open: Vec<usize>,
    partners: Vec<Option<usize>>,
}

/// No row.
const NONE: usize = usize::MAX;

impl Assignment {
    /// Largest weight; larger ones are taken for it. Sums over a million of pairs stay exact.
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

        // Rows are added one by one: the smaller side shall be theirs.
        let transposed = rows > columns;
        let (few, many) = if transposed { (columns, rows) } else { (rows, columns) };
        let weight_of = |a: usize, b: usize| {
            let weight = if transposed { weight(b, a) } else { weight(a, b) };
            weight.clamp(0, Self::MAX_WEIGHT)
        };
        self.prepare(few, many, weight_of);
        (0..few).for_each(|row| self.add_row(row, many));

        for column in 0..many {
            let row = self.row_of[column];
            if row != NONE && weight_of(row, column) > 0 {
                let (row, column) = if transposed { (column, row) } else { (row, column) };
                self.partners[row] = Some(column);
            }
        }
        &self.partners
    }

    fn prepare(&mut self, rows: usize, columns: usize, weight: impl Fn(usize, usize) -> i64) {
        self.costs.clear();
        for row in 0..rows {
            self.costs.extend((0..columns).map(|column| Self::MAX_WEIGHT - weight(row, column)));
        }
        self.row_potentials.clear();
        self.row_potentials.resize(rows, 0);
        self.column_potentials.clear();
        self.column_potentials.resize(columns, 0);
        self.row_of.clear();
        self.row_of.resize(columns + 1, NONE);
        self.previous.resize(columns + 1, 0);
    }

    /// Pairs one more row, along the cheapest path of changes that ends at a free column.
    fn add_row(&mut self, row: usize, columns: usize) {
        self.distance.clear();
        self.distance.resize(columns, i64::MAX);
        self.open.clear();
        self.open.extend(0..columns);
        self.reached.clear();
        self.row_of[columns] = row;
        let (mut column, mut length) = (columns, 0);
        while self.row_of[column] != NONE {
            (column, length) = self.reach_next(column, length, columns);
        }
        self.raise_potentials(row, length);
        while column != columns {
            let before = self.previous[column];
            self.row_of[column] = self.row_of[before];
            column = before;
        }
    }

    /// Goes on from a column that has been reached to the nearest that has not: that column and the length of
    /// its path. Of columns as near, a free one ends the search.
    fn reach_next(&mut self, from: usize, length: i64, columns: usize) -> (usize, i64) {
        let row = self.row_of[from];
        let costs = &self.costs[row * columns..(row + 1) * columns];
        let start = length - self.row_potentials[row];
        let (mut shortest, mut place, mut ends) = (i64::MAX, 0, false);
        for (at, &column) in self.open.iter().enumerate() {
            let through = start + costs[column] - self.column_potentials[column];
            if through < self.distance[column] {
                self.distance[column] = through;
                self.previous[column] = from;
            }
            let distance = self.distance[column];
            let is_free = self.row_of[column] == NONE;
            if distance < shortest || (distance == shortest && is_free && !ends) {
                (shortest, place, ends) = (distance, at, is_free);
            }
        }
        let nearest = self.open.swap_remove(place);
        self.reached.push(nearest);
        (nearest, shortest)
    }

    /// Makes the reduced costs of all pairs on the path zero, and leaves none negative.
    fn raise_potentials(&mut self, row: usize, length: i64) {
        self.row_potentials[row] += length;
        for &column in &self.reached {
            let row = self.row_of[column];
            if row != NONE {
                self.row_potentials[row] += length - self.distance[column];
                self.column_potentials[column] -= length - self.distance[column];
            }
        }
    }
}

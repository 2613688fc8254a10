use super::length::Length;

/// Number of columns that are compared at once.
const BLOCK: usize = 8;

/// Pairs rows with at least as many columns at the least cost: one row after the other, each along the
/// shortest augmenting path, which ends at a free column.
#[derive(Debug, Clone, Default)]
pub(super) struct ShortestPaths<T> {
    rows: usize,
    columns: usize,
    /// Costs row by row, each row padded to whole blocks with endless costs.
    costs: Vec<[T; BLOCK]>,
    row_potentials: Vec<T>,
    column_potentials: Vec<[T; BLOCK]>,
    row_of: Vec<Option<usize>>,
    /// Potentials of the columns that have not been reached; the others are closed.
    open_potentials: Vec<[T; BLOCK]>,
    /// Length of the shortest path so far to each column that has not been reached, and the least of each
    /// block.
    distances: Vec<[T; BLOCK]>,
    nearest: Vec<T>,
    /// The rows that were scanned, each with the length of the path to it minus its potential.
    scans: Vec<(usize, T)>,
    /// Columns that have been reached, with their distances.
    reached: Vec<(usize, T)>,
    /// Columns that have not been reached, and the place of each in this list: of equally near columns, the
    /// one in the first place is taken.
    open: Vec<usize>,
    place: Vec<usize>,
}

impl<T: Length> ShortestPaths<T> {
    /// Takes the weights; returns the greatest.
    pub(super) fn prepare(
        &mut self,
        rows: usize,
        columns: usize,
        weight: impl Fn(usize, usize) -> i64,
    ) -> i64 {
        (self.rows, self.columns) = (rows, columns);
        let blocks = columns.div_ceil(BLOCK);
        self.costs.clear();
        self.costs.resize(rows * blocks, [T::ENDLESS; BLOCK]);
        let mut greatest = 0;
        for (row, costs) in self.costs.chunks_exact_mut(blocks).enumerate() {
            for (column, cost) in costs.as_flattened_mut()[..columns].iter_mut().enumerate() {
                let weight = weight(row, column);
                greatest = greatest.max(weight);
                *cost = T::cost(weight);
            }
        }
        self.row_potentials.clear();
        self.row_potentials.resize(rows, T::default());
        self.column_potentials.clear();
        self.column_potentials.resize(blocks, [T::default(); BLOCK]);
        self.row_of.clear();
        self.row_of.resize(columns, None);
        greatest
    }

    /// The row of each column.
    pub(super) fn pair(&mut self) -> &[Option<usize>] {
        (0..self.rows).for_each(|row| self.add_row(row));
        &self.row_of
    }

    fn add_row(&mut self, row: usize) {
        self.begin_search();
        let (mut from, mut length) = (row, T::default());
        let end = loop {
            let column = self.reach_next(from, &mut length);
            match self.row_of[column] {
                Some(next) => from = next,
                None => break column,
            }
        };
        self.change_pairs(end);
        self.raise_potentials(row, length);
    }

    fn begin_search(&mut self) {
        self.open_potentials.clone_from(&self.column_potentials);
        self.distances.clear();
        self.distances.resize(self.column_potentials.len(), [T::ENDLESS; BLOCK]);
        self.nearest.resize(self.column_potentials.len(), T::ENDLESS);
        self.scans.clear();
        self.reached.clear();
        self.open.clear();
        self.open.extend(0..self.columns);
        self.place.clone_from(&self.open);
    }

    /// Scans a row, to which a path of this length leads, and reaches the nearest column not reached before;
    /// `length` becomes the length of the path to that column.
    fn reach_next(&mut self, row: usize, length: &mut T) -> usize {
        let start = T::without(*length, self.row_potentials[row]);
        self.scans.push((row, start));
        *length = self.extend_paths(row, start);
        let column = self.first_at(*length);

        self.reached.push((column, *length));
        set(&mut self.open_potentials, column, T::CLOSED);
        set(&mut self.distances, column, T::ENDLESS);
        let place = self.place[column];
        self.open.swap_remove(place);
        if let Some(&moved) = self.open.get(place) {
            self.place[moved] = place;
        }
        column
    }

    /// Shortens the paths to all columns by those through a row; returns the least length.
    fn extend_paths(&mut self, row: usize, start: T) -> T {
        let blocks = self.column_potentials.len();
        let costs = &self.costs[row * blocks..(row + 1) * blocks];
        let columns = costs.iter().zip(&self.open_potentials).zip(&mut self.distances);
        let mut least = T::ENDLESS;
        for (((costs, potentials), distances), nearest) in columns.zip(&mut self.nearest) {
            let before = *distances;
            let through: [T; BLOCK] =
                std::array::from_fn(|lane| T::through(start, costs[lane], potentials[lane]));
            *distances = std::array::from_fn(|lane| lesser(through[lane], before[lane]));
            *nearest = least_of(distances);
            least = lesser(*nearest, least);
        }
        least
    }

    /// The first open column at a distance; free columns come before others, since they end the search.
    fn first_at(&self, distance: T) -> usize {
        let mut first = None;
        for (block, &nearest) in self.nearest.iter().enumerate() {
            if nearest != distance {
                continue;
            }
            for (lane, &own) in self.distances[block].iter().enumerate() {
                let column = BLOCK * block + lane;
                if own == distance && first.is_none_or(|first| self.comes_before(column, first)) {
                    first = Some(column);
                }
            }
        }
        first.unwrap_or(0)
    }

    fn comes_before(&self, column: usize, other: usize) -> bool {
        let rank = |column: usize| (self.row_of[column].is_some(), self.place[column]);
        rank(column) < rank(other)
    }

    /// Pairs each row on the path to a column with the column that the path goes on to.
    fn change_pairs(&mut self, end: usize) {
        let mut column = end;
        let mut scan = self.scans.len();
        while scan > 0 {
            // The first scan that made the path to this column as short as it is.
            let distance = self.distance_of(column);
            let potential = get(&self.column_potentials, column);
            let made =
                |&(row, start): &(usize, T)| T::through(start, self.cost(row, column), potential) == distance;
            scan = self.scans.iter().position(made).unwrap_or(0);
            self.row_of[column] = Some(self.scans[scan].0);
            // Each row but the first was reached through the column that it was paired with.
            match scan.checked_sub(1) {
                Some(before) => column = self.reached[before].0,
                None => return,
            }
        }
    }

    fn distance_of(&self, column: usize) -> T {
        let reached = self.reached.iter().find(|(reached, _)| *reached == column);
        reached.map_or(T::ENDLESS, |(_, distance)| *distance)
    }

    fn cost(&self, row: usize, column: usize) -> T {
        let blocks = self.column_potentials.len();
        get(&self.costs[row * blocks..(row + 1) * blocks], column)
    }

    /// Makes the reduced costs of all pairs on the path zero, and leaves none negative.
    fn raise_potentials(&mut self, row: usize, length: T) {
        self.row_potentials[row] += length;
        // The column reached last is the path's end, whose potential does not change; each column before it
        // led to the row of the next scan.
        let after = self.scans.iter().skip(1);
        for (&(column, distance), &(row, _)) in self.reached.iter().zip(after) {
            let rise = T::without(length, distance);
            self.row_potentials[row] += rise;
            let mut potential = get(&self.column_potentials, column);
            potential -= rise;
            set(&mut self.column_potentials, column, potential);
        }
    }
}

#[inline]
fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

#[inline]
fn least_of<T: Length>(block: &[T; BLOCK]) -> T {
    let [a, b, c, d, e, f, g, h] = *block;
    let (a, b) = (lesser(lesser(a, c), lesser(e, g)), lesser(lesser(b, d), lesser(f, h)));
    lesser(a, b)
}

#[inline]
fn get<T: Copy>(blocks: &[[T; BLOCK]], column: usize) -> T {
    blocks[column / BLOCK][column % BLOCK]
}

#[inline]
fn set<T>(blocks: &mut [[T; BLOCK]], column: usize, value: T) {
    blocks[column / BLOCK][column % BLOCK] = value;
}

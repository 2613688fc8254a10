/// A set of cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cells: Vec<bool>,
}

/// For each corner of the cells, the number of cells of a raster before and below it.
#[derive(Debug, Clone)]
pub(super) struct Counts {
    width: usize,
    height: usize,
    sums: Vec<u32>,
}

impl Raster {
    pub(super) fn of<T>(cells: &[T], width: usize, is_in: impl Fn(&T) -> bool) -> Self {
        let cells: Vec<bool> = cells.iter().map(is_in).collect();
        Self { width, height: cells.len() / width.max(1), cells }
    }

    /// Whether a cell is in the set; false outside the grid.
    pub(super) fn at(&self, x: i64, y: i64) -> bool {
        self.index(x, y).is_some_and(|index| self.cells[index])
    }

    fn index(&self, x: i64, y: i64) -> Option<usize> {
        let [x, y] = [usize::try_from(x).ok()?, usize::try_from(y).ok()?];
        (x < self.width && y < self.height).then(|| y * self.width + x)
    }

    /// Column and row of a cell.
    pub(super) fn place(&self, index: usize) -> [i64; 2] {
        [(index % self.width) as i64, (index / self.width) as i64]
    }

    /// Whether a cell is at the border of the grid.
    pub(super) fn is_at_border(&self, index: usize) -> bool {
        let [x, y] = self.place(index).map(|c| c as usize);
        x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height
    }

    /// The cells around a cell, within the grid, and whether they touch it at a corner only; those at its sides first.
    pub(super) fn neighbours(&self, cell: usize) -> impl Iterator<Item = (usize, bool)> + '_ {
        const AROUND: [[i64; 2]; 8] = [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]];
        let [x, y] = self.place(cell);
        AROUND.iter().filter_map(move |&[dx, dy]| Some((self.index(x + dx, y + dy)?, dx * dy != 0)))
    }

    /// The cells that hang together by sides, or `across_corners` too, in the order of their first cells.
    pub(super) fn components(&self, across_corners: bool) -> Vec<Vec<usize>> {
        let mut left = self.cells.clone();
        let mut components = Vec::new();
        for first in 0..left.len() {
            if !std::mem::take(&mut left[first]) {
                continue;
            }
            let mut component = vec![first];
            let mut done = 0;
            while let Some(&cell) = component.get(done) {
                done += 1;
                for (index, is_diagonal) in self.neighbours(cell) {
                    if (across_corners || !is_diagonal) && std::mem::take(&mut left[index]) {
                        component.push(index);
                    }
                }
            }
            components.push(component);
        }
        components
    }

    /// The largest component by sides, the first of equals.
    pub(super) fn largest_component(&self) -> Option<Vec<usize>> {
        let components = self.components(false).into_iter();
        components.reduce(|largest, other| if other.len() > largest.len() { other } else { largest })
    }
}

impl Counts {
    pub(super) fn of(raster: &Raster) -> Self {
        let (width, height) = (raster.width, raster.height);
        let mut sums = vec![0_u32; (width + 1) * (height + 1)];
        for y in 0..height {
            let mut row = 0;
            for x in 0..width {
                row += u32::from(raster.cells[y * width + x]);
                sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
            }
        }
        Self { width, height, sums }
    }

    /// Whether a rectangle of cells, from one corner up to another, is within the grid and all its cells are
    /// in the set.
    pub(super) fn are_all_in(&self, low: [i64; 2], high: [i64; 2]) -> bool {
        let is_within = low[0] >= 0
            && low[1] >= 0
            && high[0] <= self.width as i64
            && high[1] <= self.height as i64
            && low[0] < high[0]
            && low[1] < high[1];
        is_within && {
            let sum = |x: i64, y: i64| i64::from(self.sums[y as usize * (self.width + 1) + x as usize]);
            let count =
                sum(high[0], high[1]) + sum(low[0], low[1]) - sum(low[0], high[1]) - sum(high[0], low[1]);
            count == (high[0] - low[0]) * (high[1] - low[1])
        }
    }
}

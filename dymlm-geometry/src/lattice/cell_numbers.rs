use dymlm_core::Point;

use super::bounds::Bounds;
use super::cell_keys::{BATCH, CellKeys};
use super::cell_table::CellTable;
use super::radix_sort::RadixSort;
use super::{CellSort, CubicLattice};

/// The lattice cells of a cloud's points, each with a number, and the order of the cells.
///
/// Only the cells are sorted, not the points: a hash table numbers them in the order of the cloud, in which
/// neighbouring numbers mostly belong to neighbouring cells. O(n + cells). Clouds too large for a packed key
/// are sorted by [`CellSort`]. Points after the first 2^32 - 2 are left out.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellNumbers {
    /// The number of each point's cell.
    numbers: Vec<u32>,
    /// Numbers in use are below this.
    end: usize,
    /// The cells, ascending by x, then y, then z. Lower half: number.
    order: Vec<u64>,
    table: CellTable,
    radix: RadixSort,
    sort: CellSort,
}

impl CellNumbers {
    /// Finds the cells of a cloud.
    pub(crate) fn find(&mut self, lattice: CubicLattice, points: &[Point]) {
        let points = points.get(..u32::MAX as usize - 1).unwrap_or(points);
        self.numbers.clear();
        self.numbers.resize(points.len(), 0);
        self.order.clear();
        self.end = 1;
        let Some(bounds) = Bounds::of(points) else { return };
        if let Some(keys) = CellKeys::new(lattice, &bounds) {
            self.number_by_key(&keys, points);
            self.sort_by_key(keys.max_key());
        } else {
            self.number_sorted(lattice, points);
        }
    }

    /// The number of each point's cell; points that are not finite have numbers that no cell has.
    #[inline]
    pub(crate) fn of_points(&self) -> &[u32] {
        &self.numbers
    }

    /// All numbers, those of points that are not finite included, are below this.
    #[inline]
    pub(crate) fn end(&self) -> usize {
        self.end
    }

    /// The numbers of the cells, ascending by x, then y, then z of the cells.
    #[inline]
    pub(crate) fn ascending(&self) -> impl ExactSizeIterator<Item = usize> + '_ {
        self.order.iter().map(|&entry| entry as u32 as usize)
    }

    fn number_by_key(&mut self, cell_keys: &CellKeys, points: &[Point]) {
        self.table.clear(points.len());
        let mut runs = Runs { keys: [0; BATCH], of_points: [0; BATCH] };
        let mut numbers = self.numbers.chunks_mut(BATCH);
        cell_keys.for_each_batch(points, |_, keys| {
            let count = runs.find(keys);
            let mut run_numbers = [0; BATCH];
            for (number, &key) in run_numbers.iter_mut().zip(&runs.keys[..count]) {
                *number = self.table.number(key);
            }
            let Some(numbers) = numbers.next() else { return };
            for (number, &run) in numbers.iter_mut().zip(&runs.of_points) {
                *number = run_numbers[usize::from(run)];
            }
        });
        self.end = self.table.keys().len();
    }

    fn sort_by_key(&mut self, max_key: u64) {
        let keys = self.table.keys();
        let cells = (0_u64..).zip(keys).skip(1).filter(|&(_, &key)| key != CellKeys::NOT_FINITE);
        self.order.reserve(keys.len());
        self.order.extend(cells.map(|(number, key)| key << 32 | number));
        self.radix.sort_by_keys(&mut self.order, keys, max_key);
    }

    /// Numbers the cells in their order.
    fn number_sorted(&mut self, lattice: CubicLattice, points: &[Point]) {
        self.sort.sort(lattice, points);
        self.end = self.sort.cell_count() + 1;
        self.order.extend(1..self.end as u64);
        for cell in 0..self.sort.cell_count() {
            for run in self.sort.runs_of_cell(cell) {
                self.numbers[run].fill(cell as u32 + 1);
            }
        }
    }
}

/// Runs of successive points of a batch in one cell, so that each is looked up once. A run's number fits in a byte.
struct Runs {
    keys: [u64; BATCH],
    /// The run of each point.
    of_points: [u8; BATCH],
}

impl Runs {
    /// Finds the runs of a batch; returns their number. No branch depends on what a processor cannot predict.
    #[inline]
    fn find(&mut self, keys: &[u64]) -> usize {
        let Some(&first) = keys.first() else { return 0 };
        let (mut run, mut previous) = (0_u8, first);
        for (&key, of_point) in keys.iter().zip(&mut self.of_points) {
            // At most 255 times: the first point adds none.
            run = run.wrapping_add(u8::from(key != previous));
            self.keys[usize::from(run)] = key;
            *of_point = run;
            previous = key;
        }
        usize::from(run) + 1
    }
}

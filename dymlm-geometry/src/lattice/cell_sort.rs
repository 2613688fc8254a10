use std::ops::Range;

use dymlm_core::Point;

use super::CubicLattice;
use super::bounds::Bounds;
use super::cell_keys::CellKeys;
use super::radix_sort::RadixSort;
use crate::finite::is_finite;

/// The points of a cloud, sorted by lattice cell.
///
/// Cells ascend by x, then y, then z; the points of a cell keep the order of the cloud. Points that are not
/// finite and points after the first 2^32 - 1 are left out.
///
/// It sorts *runs* of successive points in one cell rather than points: neighbouring pixels mostly share a
/// cell. O(n): a radix sort on one packed key per run, or, where the extent holds more cells than there are
/// keys, on the three indices one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellSort {
    /// First point of each run, and the number of points at the end.
    run_starts: Vec<u32>,
    /// The runs of finite points. Upper half: sort key; lower half: number of the run.
    entries: Vec<u64>,
    /// The key of each run, where keys have more than 32 bits.
    wide_keys: Vec<u64>,
    radix: RadixSort,
    /// First entry of each cell, and the number of entries at the end.
    cell_starts: Vec<u32>,
}

impl CellSort {
    /// Sorts a cloud.
    pub(crate) fn sort(&mut self, lattice: CubicLattice, points: &[Point]) {
        let points = points.get(..u32::MAX as usize).unwrap_or(points);
        let Some(bounds) = Bounds::of(points) else {
            self.entries.clear();
            self.find_cells(|_, _| true);
            return;
        };
        let Some(keys) = CellKeys::new(lattice, &bounds) else {
            self.sort_by_each_axis(lattice, points);
            return;
        };
        if let Ok(max_key) = u32::try_from(keys.max_key()) {
            self.find_runs(&keys, points, |_, _| {});
            self.radix.sort(&mut self.entries, max_key);
            self.find_cells(|a, b| (a ^ b) >> 32 == 0);
        } else {
            self.sort_by_wide_key(&keys, points);
        }
    }

    /// Number of cells.
    #[inline]
    pub(crate) fn cell_count(&self) -> usize {
        self.cell_starts.len().saturating_sub(1)
    }

    /// The points of a cell: ranges of the cloud, ascending.
    #[inline]
    pub(crate) fn runs_of_cell(&self, cell: usize) -> impl Iterator<Item = Range<usize>> + Clone + '_ {
        let entries = &self.entries[self.cell_starts[cell] as usize..self.cell_starts[cell + 1] as usize];
        entries.iter().map(|&entry| self.run(entry))
    }

    #[inline]
    fn run(&self, entry: u64) -> Range<usize> {
        let run = entry as u32 as usize;
        self.run_starts[run] as usize..self.run_starts[run + 1] as usize
    }

    /// Cuts the cloud where the key changes, without a branch on what a processor cannot predict. Of a key the lower
    /// 32 bits are put into the entries; `note` is told the number of each run with its whole key.
    fn find_runs(&mut self, cell_keys: &CellKeys, points: &[Point], mut note: impl FnMut(usize, u64)) {
        self.run_starts.resize(points.len() + 1, 0);
        self.entries.resize(points.len(), 0);
        let (mut runs, mut entries, mut index) = (0, 0, 0);
        // No point has this key.
        let mut previous = CellKeys::NOT_FINITE - 1;
        cell_keys.for_each_batch(points, |_, keys| {
            for &key in keys {
                // Overwritten by the next point unless this one begins a run.
                self.run_starts[runs] = index;
                self.entries[entries] = key << 32 | runs as u64;
                note(runs, key);
                let begins = previous != key;
                runs += usize::from(begins);
                entries += usize::from(begins) & usize::from(key != CellKeys::NOT_FINITE);
                (previous, index) = (key, index + 1);
            }
        });
        self.run_starts.truncate(runs);
        self.run_starts.push(points.len() as u32);
        self.entries.truncate(entries);
    }

    /// By keys of more than 32 bits.
    fn sort_by_wide_key(&mut self, cell_keys: &CellKeys, points: &[Point]) {
        let mut keys = std::mem::take(&mut self.wide_keys);
        keys.resize(points.len(), 0);
        self.find_runs(cell_keys, points, |run, key| keys[run] = key);
        self.radix.sort_by_keys(&mut self.entries, &keys, cell_keys.max_key());
        let key = |entry: u64| keys[entry as u32 as usize];
        self.find_cells(|a, b| key(a) == key(b));
        self.wide_keys = keys;
    }

    /// Least significant axis first; the sort is stable.
    fn sort_by_each_axis(&mut self, lattice: CubicLattice, points: &[Point]) {
        // Each point is a run of its own.
        self.run_starts.clear();
        self.run_starts.extend(0..=points.len() as u32);
        self.entries.clear();
        self.entries.extend(
            (0..).zip(points).filter(|(_, point)| is_finite(point)).map(|(index, _): (u64, _)| index),
        );
        for axis in [2, 1, 0] {
            let index = |entry: u64| lattice.index(points[entry as u32 as usize][axis]);
            let indices = || self.entries.iter().map(|&entry| index(entry));
            let least = indices().min().unwrap_or_default();
            let greatest = indices().max().unwrap_or_default();
            for entry in &mut self.entries {
                *entry = u64::from(index(*entry).abs_diff(least)) << 32 | u64::from(*entry as u32);
            }
            self.radix.sort(&mut self.entries, greatest.abs_diff(least));
        }
        let cell = |entry: u64| points[entry as u32 as usize].map(|x| lattice.index(x));
        self.find_cells(|a, b| cell(a) == cell(b));
    }

    /// Cuts the sorted entries where the cell changes.
    fn find_cells(&mut self, same_cell: impl Fn(u64, u64) -> bool) {
        self.cell_starts.resize(self.entries.len() + 1, 0);
        let mut cells = usize::from(!self.entries.is_empty());
        for (index, pair) in (1..).zip(self.entries.windows(2)) {
            self.cell_starts[cells] = index;
            cells += usize::from(!same_cell(pair[0], pair[1]));
        }
        self.cell_starts.truncate(cells);
        self.cell_starts.push(self.entries.len() as u32);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn cells_are_in_order_and_have_their_points_in_the_order_of_the_cloud() {
        let mut random = SplitMix64::new(7);
        let mut coordinate = || if random.below(30) == 0 { f32::NAN } else { random.fraction() as f32 - 0.5 };
        // Pairs of neighbours, so that there are runs.
        let points: Vec<Point> =
            (0..2000).map(|_| std::array::from_fn(|_| coordinate())).flat_map(|point| [point; 2]).collect();
        let mut sort = CellSort::default();
        // Keys of 10, of 30 and of 50 bits, and more cells than there are keys.
        for side in [0.1, 1e-3, 1e-5, 5e-7] {
            let lattice = CubicLattice::new(side);
            let mut cells: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
            for (index, point) in points.iter().enumerate().filter(|(_, point)| is_finite(point)) {
                cells.entry(point.map(|x| lattice.index(x))).or_default().push(index);
            }
            sort.sort(lattice, &points);
            let found = (0..sort.cell_count()).map(|cell| sort.runs_of_cell(cell).flatten().collect());
            assert_eq!(found.collect::<Vec<Vec<usize>>>(), cells.into_values().collect::<Vec<_>>(), "{side}");
        }
    }
}

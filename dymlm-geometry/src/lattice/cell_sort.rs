use std::ops::Range;

use dymlm_core::Point;

use super::CubicLattice;
use super::bounds::Bounds;
use super::cell_keys::INTEGERS_FROM;
use super::radix_sort::RadixSort;
use crate::finite::is_finite;

/// The points of a cloud, sorted by lattice cell.
///
/// Cells ascend by x, then y, then z; the points of a cell keep the order of the cloud. Points that are not
/// finite and points after the first 2^32 - 1 are left out.
///
/// It sorts *runs* of successive points in one cell rather than points: neighbouring pixels mostly share a
/// cell. O(n): a radix sort on one packed key per run, or, where the extent is too large for a key of 32
/// bits, on the three indices one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellSort {
    /// First point of each run, and the number of points at the end.
    run_starts: Vec<u32>,
    /// The runs of finite points. Upper half: sort key; lower half: number of the run.
    entries: Vec<u64>,
    radix: RadixSort,
    /// First entry of each cell, and the number of entries at the end.
    cell_starts: Vec<u32>,
}

/// The cells from the least to the greatest finite coordinate.
struct Extent {
    /// Least index, an integer, of each axis.
    base: [f64; 3],
    /// Number of cells along y and z.
    cells: [u32; 2],
    /// Greatest key of a cell.
    max_key: u32,
}

/// The key of points that are not finite; no cell has it.
const NOT_FINITE: u64 = u64::MAX;

impl CellSort {
    /// Sorts a cloud.
    pub(crate) fn sort(&mut self, lattice: CubicLattice, points: &[Point]) {
        let points = points.get(..u32::MAX as usize).unwrap_or(points);
        let Some(bounds) = Bounds::of(points) else {
            self.entries.clear();
            self.find_cells(|_, _| true);
            return;
        };
        if let Some(extent) = Extent::new(lattice, bounds.min, bounds.max) {
            let key = |point: &Point| u64::from(extent.key(lattice, point));
            if bounds.all_finite {
                self.find_runs(points, key);
            } else {
                self.find_runs(points, |point| if is_finite(point) { key(point) } else { NOT_FINITE });
            }
            self.radix.sort(&mut self.entries, extent.max_key);
            self.find_cells(|a, b| (a ^ b) >> 32 == 0);
        } else {
            self.sort_by_each_axis(lattice, points);
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

    /// Cuts the cloud where the key changes, without a branch on what a processor cannot predict.
    fn find_runs(&mut self, points: &[Point], key: impl Fn(&Point) -> u64) {
        self.run_starts.resize(points.len() + 1, 0);
        self.entries.resize(points.len(), 0);
        let (mut runs, mut entries) = (0, 0);
        // No point has this key.
        let mut previous = NOT_FINITE - 1;
        for (index, point) in (0..).zip(points) {
            let key = key(point);
            // Overwritten by the next point unless this one begins a run.
            self.run_starts[runs] = index;
            self.entries[entries] = key << 32 | runs as u64;
            let begins = previous != key;
            runs += usize::from(begins);
            entries += usize::from(begins) & usize::from(key != NOT_FINITE);
            previous = key;
        }
        self.run_starts.truncate(runs);
        self.run_starts.push(points.len() as u32);
        self.entries.truncate(entries);
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

impl Extent {
    /// `None` when a key of 32 bits does not tell all cells apart.
    fn new(lattice: CubicLattice, min: Point, max: Point) -> Option<Self> {
        if !min.iter().chain(&max).all(|&x| lattice.counts(x)) {
            return None;
        }
        let base = min.map(|x| lattice.counted_index(x));
        let sizes: [u64; 3] =
            std::array::from_fn(|axis| (lattice.counted_index(max[axis]) - base[axis]) as u64 + 1);
        let cells = sizes[0].checked_mul(sizes[1])?.checked_mul(sizes[2])?;
        let max_key = u32::try_from(cells - 1).ok()?;
        Some(Self { base, cells: [sizes[1] as u32, sizes[2] as u32], max_key })
    }

    /// The cell's number, counted along z, then y, then x.
    #[inline]
    fn key(&self, lattice: CubicLattice, point: &Point) -> u32 {
        let [x, y, z] = std::array::from_fn(|axis| {
            // The low bits of 2^52 + i are i: a conversion without the checks of `as`.
            (lattice.counted_index(point[axis]) - self.base[axis] + INTEGERS_FROM as f64).to_bits() as u32
        });
        // The products stay below the number of cells, for points within the extent.
        x.wrapping_mul(self.cells[0]).wrapping_add(y).wrapping_mul(self.cells[1]).wrapping_add(z)
    }
}

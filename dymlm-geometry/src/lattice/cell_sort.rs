use dymlm_core::Point;

use super::CubicLattice;
use super::radix_sort::RadixSort;

/// The points of a cloud, sorted by lattice cell.
///
/// Cells ascend by x, then y, then z; the points of a cell keep the order of the cloud. Points that are not finite
/// are left out, and so is what follows the first 2^32 - 1 points. O(n): a radix sort on one packed key a point,
/// or, where the extent is too large for a key of 32 bits, on the three indices one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellSort {
    /// Upper half: sort key; lower half: index of the point.
    entries: Vec<u64>,
    radix: RadixSort,
    /// First slot of each cell, and the number of slots at the end.
    starts: Vec<u32>,
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

impl CellSort {
    /// Sorts a cloud.
    pub(crate) fn sort(&mut self, lattice: CubicLattice, points: &[Point]) {
        let points = points.get(..u32::MAX as usize).unwrap_or(points);
        self.entries.clear();
        self.starts.clear();
        let Some([min, max]) = finite_bounds(points) else {
            self.starts.push(0);
            return;
        };
        if let Some(extent) = Extent::new(lattice, min, max) {
            self.sort_by_packed_key(lattice, &extent, points);
        } else {
            self.sort_by_each_axis(lattice, points);
        }
    }

    /// Number of slots: of finite points.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    /// First slot of each cell, and the number of slots at the end.
    #[inline]
    pub(crate) fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// The points in some slots, as entries.
    #[inline]
    pub(crate) fn entries(&self, slots: std::ops::Range<usize>) -> &[u64] {
        &self.entries[slots]
    }

    /// Index into the cloud of the point that an entry stands for.
    #[inline]
    pub(crate) fn point_index(entry: u64) -> usize {
        entry as u32 as usize
    }

    fn sort_by_packed_key(&mut self, lattice: CubicLattice, extent: &Extent, points: &[Point]) {
        self.entries.extend(
            (0..)
                .zip(points)
                .filter(|(_, point)| is_finite(point))
                .map(|(index, point): (u64, _)| (u64::from(extent.key(lattice, point)) << 32) | index),
        );
        self.radix.sort(&mut self.entries, extent.max_key);
        self.find_starts(|a, b| (a ^ b) >> 32 == 0);
    }

    /// Least significant axis first; the sort is stable.
    fn sort_by_each_axis(&mut self, lattice: CubicLattice, points: &[Point]) {
        self.entries.extend(
            (0..).zip(points).filter(|(_, point)| is_finite(point)).map(|(index, _): (u64, _)| index),
        );
        for axis in [2, 1, 0] {
            let index = |entry: u64| lattice.index(points[Self::point_index(entry)][axis]);
            let indices = || self.entries.iter().map(|&entry| index(entry));
            let least = indices().min().unwrap_or_default();
            let greatest = indices().max().unwrap_or_default();
            for entry in &mut self.entries {
                *entry = (u64::from(index(*entry).abs_diff(least)) << 32) | u64::from(*entry as u32);
            }
            self.radix.sort(&mut self.entries, greatest.abs_diff(least));
        }
        let cell = |entry: u64| points[Self::point_index(entry)].map(|x| lattice.index(x));
        self.find_starts(|a, b| cell(a) == cell(b));
    }

    /// Finds the slots where a cell begins, without a branch on what no processor could predict.
    fn find_starts(&mut self, same_cell: impl Fn(u64, u64) -> bool) {
        self.starts.resize(self.entries.len() + 1, 0);
        let mut cells = 1;
        for (slot, pair) in (1..).zip(self.entries.windows(2)) {
            self.starts[cells] = slot;
            cells += usize::from(!same_cell(pair[0], pair[1]));
        }
        self.starts.truncate(cells);
        self.starts.push(self.entries.len() as u32);
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
            const INTEGER: f64 = (1_u64 << 52) as f64;
            (lattice.counted_index(point[axis]) - self.base[axis] + INTEGER).to_bits() as u32
        });
        // The products stay below the number of cells, for points within the extent.
        x.wrapping_mul(self.cells[0]).wrapping_add(y).wrapping_mul(self.cells[1]).wrapping_add(z)
    }
}

/// Least and greatest coordinates of the finite points; `None` when there is none.
fn finite_bounds(points: &[Point]) -> Option<[Point; 2]> {
    let mut min = [f32::INFINITY; 3];
    let mut max = [f32::NEG_INFINITY; 3];
    for point in points.iter().filter(|point| is_finite(point)) {
        for axis in 0..3 {
            min[axis] = if point[axis] < min[axis] { point[axis] } else { min[axis] };
            max[axis] = if point[axis] > max[axis] { point[axis] } else { max[axis] };
        }
    }
    (min[0] <= max[0]).then_some([min, max])
}

/// One test for three coordinates: 0 x is NaN for NaN and the infinities.
#[inline]
fn is_finite(point: &Point) -> bool {
    (0.0 * point[0] + 0.0 * point[1] + 0.0 * point[2]) == 0.0
}

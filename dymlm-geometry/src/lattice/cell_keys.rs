use dymlm_core::Point;

use super::CubicLattice;
use super::bounds::Bounds;
use crate::finite::is_finite;

/// Number of points whose keys are computed together, in vector registers.
const TOGETHER: usize = 4;

/// Number of points whose keys are computed before they are used.
pub(super) const BATCH: usize = 256;

/// Between 2^52 and 2^53 the f64 are exactly the integers, and their low 52 bits count them.
const INTEGERS_FROM: u64 = 1 << 52;

/// Numbers the cells of an extent along z, then y, then x: ascending keys are ascending x, then y, then z.
///
/// Keys are computed in f64, which holds the numbers of up to 2^52 cells.
pub(super) struct CellKeys {
    lattice: CubicLattice,
    /// Least index of each axis, an integer; repeated for each of the points computed together.
    base: [f64; 3 * TOGETHER],
    /// Number of keys from a cell to the next along each axis.
    stride: [f64; 3 * TOGETHER],
    all_finite: bool,
    max_key: u64,
}

impl CellKeys {
    /// The key given to points that are not finite; no cell has it.
    pub(super) const NOT_FINITE: u64 = u64::MAX;

    /// `None` when the bounds hold more cells than there are keys.
    pub(super) fn new(lattice: CubicLattice, bounds: &Bounds) -> Option<Self> {
        if !bounds.min.iter().chain(&bounds.max).all(|&x| lattice.counts(x)) {
            return None;
        }
        let base = bounds.min.map(|x| lattice.counted_index(x));
        let cells: [f64; 3] =
            std::array::from_fn(|axis| lattice.counted_index(bounds.max[axis]) - base[axis] + 1.0);
        // Factors are below 2^28, so that rounding of the product cannot hide that it is too large.
        let count = cells[0] * cells[1] * cells[2];
        (count < INTEGERS_FROM as f64).then(|| {
            let stride = [cells[1] * cells[2], cells[2], 1.0];
            Self {
                lattice,
                base: std::array::from_fn(|i| base[i % 3]),
                stride: std::array::from_fn(|i| stride[i % 3]),
                all_finite: bounds.all_finite,
                max_key: count as u64 - 1,
            }
        })
    }

    /// The greatest key of a cell.
    pub(super) fn max_key(&self) -> u64 {
        self.max_key
    }

    /// Calls `visit` with each [`BATCH`] of points and their keys.
    #[inline]
    pub(super) fn for_each_batch(&self, points: &[Point], mut visit: impl FnMut(&[Point], &[u64])) {
        let mut keys = [[0; TOGETHER]; BATCH / TOGETHER];
        for points in points.chunks(BATCH) {
            self.write(points, &mut keys);
            visit(points, &keys.as_flattened()[..points.len()]);
        }
    }

    /// Writes the keys of points, at most as many as there are keys.
    fn write(&self, points: &[Point], keys: &mut [[u64; TOGETHER]]) {
        let (fours, rest) = points.as_chunks::<TOGETHER>();
        // The rest as four points, the last one repeated.
        let last = rest.last().map(|last| std::array::from_fn(|i| *rest.get(i).unwrap_or(last)));
        for (points, keys) in fours.iter().chain(&last).zip(&mut *keys) {
            *keys = self.keys(points);
        }
        if !self.all_finite {
            for (point, key) in points.iter().zip(keys.as_flattened_mut()) {
                *key = if is_finite(point) { *key } else { Self::NOT_FINITE };
            }
        }
    }

    #[inline]
    fn keys(&self, points: &[Point; TOGETHER]) -> [u64; TOGETHER] {
        let coordinates = points.as_flattened();
        let parts: [f64; 3 * TOGETHER] = std::array::from_fn(|i| {
            (self.lattice.counted_index(coordinates[i]) - self.base[i]) * self.stride[i]
        });
        std::array::from_fn(|i| {
            let key = parts[3 * i] + parts[3 * i + 1] + parts[3 * i + 2];
            (key + INTEGERS_FROM as f64).to_bits() & (INTEGERS_FROM - 1)
        })
    }
}

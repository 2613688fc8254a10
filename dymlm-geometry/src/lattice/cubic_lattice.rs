/// Cells up to this distance from the origin are counted; beyond, coordinates are ranked.
const COUNTED: i32 = 1 << 26;

/// Bits of 32.0, less than any coordinate beyond the counted cells (see [`CubicLattice::MIN_SIDE`]).
const RANKS_FROM: i32 = 0x4200_0000;

/// Adding and subtracting this rounds an f64 below 2^51 to an integer, without a call and in vector
/// registers.
const ROUNDING: u64 = 3 << 51;

/// A lattice of cubic cells anchored at the origin: cell i of an axis covers [i, i + 1) sides.
///
/// Any finite f32 has an index, and no two coordinates more than a side apart share one. Up to 2^26 cells
/// from the origin, index(x) = floor(x / side) evaluated as floor(x * (1 / side)) in f64, off by at most
/// 2^-26 of a cell at the cell's border. Beyond, one step of an f32 is longer than four cells: distinct
/// coordinates lie in distinct cells, so that a coordinate's rank among all f32 serves as the index.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct CubicLattice {
    cells_per_metre: f64,
}

impl CubicLattice {
    /// Smallest side for which every index fits in an i32: 32 m are fewer than 2^26 cells then.
    pub(crate) const MIN_SIDE: f64 = 5e-7;

    /// A lattice of cells of `side` metres, at least [`Self::MIN_SIDE`].
    pub(crate) fn new(side: f64) -> Self {
        Self { cells_per_metre: 1.0 / side.max(Self::MIN_SIDE) }
    }

    /// Index of the cell of a finite coordinate.
    #[inline]
    pub(crate) fn index(self, x: f32) -> i32 {
        if self.counts(x) {
            self.counted_index(x) as i32
        } else {
            let rank = (x.abs().to_bits() as i32 - RANKS_FROM) + COUNTED;
            if x > 0.0 { rank } else { -rank }
        }
    }

    /// Whether a coordinate lies within the counted cells.
    #[inline]
    pub(crate) fn counts(self, x: f32) -> bool {
        (f64::from(x) * self.cells_per_metre).abs() < f64::from(COUNTED)
    }

    /// Index of the cell of a coordinate within the counted cells, as an integral f64.
    #[inline]
    pub(crate) fn counted_index(self, x: f32) -> f64 {
        let cells = f64::from(x) * self.cells_per_metre;
        let nearest = (cells + ROUNDING as f64) - ROUNDING as f64;
        nearest - if nearest > cells { 1.0 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_cells_like_floor() {
        let lattice = CubicLattice::new(0.25);
        let cases =
            [(0.0, 0), (0.24, 0), (0.25, 1), (-0.1, -1), (-0.25, -1), (-0.26, -2), (1e-30, 0), (-1e-30, -1)];
        for (x, expected) in cases {
            assert_eq!(lattice.index(x), expected, "{x}");
        }
        for i in -4_000..4_000_i16 {
            let x = f32::from(i) * 0.013;
            assert_eq!(lattice.index(x), (f64::from(x) * 4.0).floor() as i32, "{x}");
        }
    }

    #[test]
    fn indices_ascend_over_all_magnitudes() {
        for side in [5e-7, 1e-3, 0.05, 3.7, 1e6] {
            let lattice = CubicLattice::new(side);
            // Both sides of the border between counted and ranked cells, and the ends of f32.
            let border = (f64::from(COUNTED) * side) as f32;
            let around =
                |x: f32| (-40..40).map(move |step| f32::from_bits((x.to_bits() as i32 + step) as u32));
            let far: Vec<f32> = around(border).chain(around(border * 1e4)).chain([f32::MAX]).collect();
            let mut coordinates: Vec<f32> =
                far.iter().map(|x| -x).chain(far.iter().copied()).chain([0.0, -border / 7.0]).collect();
            coordinates.sort_by(f32::total_cmp);
            for pair in coordinates.windows(2) {
                let (low, high) = (lattice.index(pair[0]), lattice.index(pair[1]));
                assert!(low <= high, "{pair:?} {low} {high} side {side}");
                assert!(
                    low != high || f64::from(pair[1]) - f64::from(pair[0]) <= side,
                    "{pair:?} side {side}"
                );
            }
        }
    }
}

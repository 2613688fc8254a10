use std::array::from_fn;

use crate::Extent;

/// A box of cells. It may reach beyond the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct CellBox {
    /// Index of the first cell along each axis, 0 for the cell whose lower corner is the world's origin.
    pub(super) first: [i64; 3],
    /// Number of cells along each axis.
    pub(super) size: [usize; 3],
}

impl CellBox {
    /// The cells whose centres enclose every point of a region, at least two along each axis; `None` for a
    /// region that ends before it begins, is not finite or lies too far out.
    pub(super) fn around(region: &Extent, resolution: f64) -> Option<Self> {
        let Extent { min, max } = *region;
        let is_near = |c: &f64| c.abs() / resolution < 1e9;
        if !((0..3).all(|axis| min[axis] <= max[axis]) && min.iter().chain(&max).all(is_near)) {
            return None;
        }
        let last_before = |c: f64| (c / resolution - 0.5).floor() as i64;
        let first = min.map(last_before);
        let size = from_fn(|axis| (last_before(max[axis]) - first[axis] + 2) as usize);
        Some(Self { first, size })
    }

    /// The box with `cells` more cells on each side; `None` when their total number overflows a `u64`.
    pub(super) fn grown(&self, cells: usize) -> Option<Self> {
        let size = self.size.map(|side| side + 2 * cells);
        size.iter().try_fold(1_u64, |product, &side| product.checked_mul(side as u64))?;
        Some(Self { first: self.first.map(|index| index - cells as i64), size })
    }

    pub(super) fn len(&self) -> u64 {
        self.size.iter().map(|&side| side as u64).product()
    }

    /// Index in an array (x fastest) of the cell with these indices, counted from the first cell.
    #[inline]
    pub(super) fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Centre of the first and of the last cell.
    pub(super) fn centers(&self, resolution: f64) -> [[f64; 3]; 2] {
        let center = |index: i64| (index as f64 + 0.5) * resolution;
        [from_fn(|axis| center(self.first[axis])), from_fn(|axis| center(self.last(axis)))]
    }

    pub(super) fn last(&self, axis: usize) -> i64 {
        self.first[axis] + self.size[axis] as i64 - 1
    }
}

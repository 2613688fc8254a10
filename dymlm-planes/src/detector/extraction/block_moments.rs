use wide::{f32x4, f64x2};

use super::super::rays::Rays;
use super::block_grid::BlockGrid;
use crate::moments::Moments;

/// Adjacent columns of a block that are summed at once.
const COLUMNS: usize = 4;

/// Sums over the readings of adjacent columns of a block, in pairs.
///
/// A point is z (a, b, 1) with a = `ray_x` of its column and b = `ray_y` of its row. The sums over a column
/// do not need a: it is multiplied in once per column, not once per pixel.
#[derive(Debug, Clone, Copy, Default)]
struct ColumnSums {
    count: f32x4,
    pairs: [PairSums; COLUMNS / 2],
}

#[derive(Debug, Clone, Copy, Default)]
struct PairSums {
    z: f64x2,
    bz: f64x2,
    zz: f64x2,
    bzz: f64x2,
    bbzz: f64x2,
}

/// Sums up the points of each block of a row of blocks, in f64. `depths` are the rows of pixels of these
/// blocks (0 = no reading).
///
/// O(pixels), four multiplications per pixel, four columns at a time.
pub(super) fn sum_blocks(depths: &[f32], grid: &BlockGrid, row: usize, rays: &Rays, out: &mut Vec<Moments>) {
    let first = row * grid.columns;
    let ray_y = &rays.y[grid.pixel_rows(first)];
    out.extend((first..first + grid.columns).map(|block| {
        let columns = grid.pixel_columns(block);
        let mut moments = Moments::default();
        for u in columns.clone().step_by(COLUMNS) {
            let ray_x = &rays.x[u..columns.end.min(u + COLUMNS)];
            let rows = depths.chunks_exact(grid.width).map(|row| &row[u..]);
            sum_columns(rows, ray_x.len(), ray_y).add_to(ray_x, &mut moments);
        }
        moments
    }));
}

/// Sums of the first `count` columns over some rows of the image.
#[inline]
fn sum_columns<'a>(rows: impl Iterator<Item = &'a [f32]>, count: usize, ray_y: &[f64]) -> ColumnSums {
    let mut sums = ColumnSums::default();
    for (row, &b) in rows.zip(ray_y) {
        match row.first_chunk::<COLUMNS>() {
            Some(readings) if count == COLUMNS => sums.add(*readings, b),
            // The last columns of a narrow block; the columns that are missing have no readings.
            _ => sums.add(std::array::from_fn(|k| if k < count { row[k] } else { 0.0 }), b),
        }
    }
    sums
}

impl ColumnSums {
    /// Adds a row of readings at the ray height `b`.
    #[inline]
    fn add(&mut self, readings: [f32; COLUMNS], b: f64) {
        let all = f32x4::from(readings);
        self.count += f32x4::ONE & all.simd_gt(f32x4::ZERO);
        let [z0, z1, z2, z3] = readings.map(f64::from);
        for (sums, pair) in self.pairs.iter_mut().zip([[z0, z1], [z2, z3]]) {
            sums.add(f64x2::from(pair), f64x2::splat(b));
        }
    }

    /// Adds the sums of the columns with these rays.
    #[inline]
    fn add_to(&self, ray_x: &[f64], moments: &mut Moments) {
        let count = self.count.to_array();
        for (k, a) in ray_x.iter().enumerate() {
            let PairSums { z, bz, zz, bzz, bbzz } = self.pairs[k / 2];
            let [z, bz, zz, bzz, bbzz] = [z, bz, zz, bzz, bbzz].map(|pair| pair.to_array()[k % 2]);
            let azz = a * zz;
            moments.add(&Moments {
                weight: f64::from(count[k]),
                first: [a * z, bz, z],
                second: [a * azz, a * bzz, azz, bbzz, bzz, zz],
            });
        }
    }
}

impl PairSums {
    #[inline]
    fn add(&mut self, z: f64x2, b: f64x2) {
        let (bz, zz) = (b * z, z * z);
        let bzz = b * zz;
        self.z += z;
        self.bz += bz;
        self.zz += zz;
        self.bzz += bzz;
        self.bbzz += b * bzz;
    }
}

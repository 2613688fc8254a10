use super::super::rays::Rays;
use super::block_grid::BlockGrid;
use crate::moments::Moments;

/// Sums over the readings of N adjacent columns of a block.
///
/// A point is z (a, b, 1) with a = `ray_x` of its column and b = `ray_y` of its row. The sums over a column
/// do not need a: it is multiplied in once per column, not once per pixel.
#[derive(Debug, Clone, Copy)]
struct ColumnSums<const N: usize> {
    count: [f32; N],
    z: [f64; N],
    bz: [f64; N],
    zz: [f64; N],
    bzz: [f64; N],
    bbzz: [f64; N],
}

/// Sums up the points of each block of a row of blocks, in f64. `depths` are the rows of pixels of these
/// blocks (0 = no reading).
///
/// O(pixels), four multiplications per pixel, two columns at a time.
pub(super) fn sum_blocks(depths: &[f32], grid: &BlockGrid, row: usize, rays: &Rays, out: &mut Vec<Moments>) {
    let first = row * grid.columns;
    let ray_y = &rays.y[grid.pixel_rows(first)];
    out.extend((first..first + grid.columns).map(|block| {
        let columns = grid.pixel_columns(block);
        let mut moments = Moments::default();
        let mut u = columns.start;
        while u + 2 <= columns.end {
            add_columns(&sum_columns::<2>(depths, grid.width, u, ray_y), &rays.x[u..], &mut moments);
            u += 2;
        }
        for u in u..columns.end {
            add_columns(&sum_columns::<1>(depths, grid.width, u, ray_y), &rays.x[u..], &mut moments);
        }
        moments
    }));
}

/// Sums of columns u..u + N over some rows of the image.
#[inline]
fn sum_columns<const N: usize>(depths: &[f32], width: usize, u: usize, ray_y: &[f64]) -> ColumnSums<N> {
    let zero = [0.0; N];
    let mut sums = ColumnSums { count: [0.0; N], z: zero, bz: zero, zz: zero, bzz: zero, bbzz: zero };
    for (row, &b) in depths.chunks_exact(width).zip(ray_y) {
        let Some(readings) = row[u..].first_chunk::<N>() else { continue };
        for (k, &reading) in readings.iter().enumerate() {
            let z = f64::from(reading);
            let (bz, zz) = (b * z, z * z);
            let bzz = b * zz;
            sums.count[k] += if reading > 0.0 { 1.0 } else { 0.0 };
            sums.z[k] += z;
            sums.bz[k] += bz;
            sums.zz[k] += zz;
            sums.bzz[k] += bzz;
            sums.bbzz[k] += b * bzz;
        }
    }
    sums
}

#[inline]
fn add_columns<const N: usize>(sums: &ColumnSums<N>, ray_x: &[f64], moments: &mut Moments) {
    for (k, a) in ray_x[..N].iter().enumerate() {
        let azz = a * sums.zz[k];
        moments.add(&Moments {
            weight: f64::from(sums.count[k]),
            first: [a * sums.z[k], sums.bz[k], sums.z[k]],
            second: [a * azz, a * sums.bzz[k], azz, sums.bbzz[k], sums.bzz[k], sums.zz[k]],
        });
    }
}

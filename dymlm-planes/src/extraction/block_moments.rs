use super::block_grid::{BlockGrid, Rays};
use crate::moments::Moments;

/// Sums over the readings of one block's columns, for some columns side by side.
///
/// A point is z (a, b, 1) with a = `ray_x` of its column and b = `ray_y` of its row, so the sums over a column need no a
/// at all: it enters once a column, not once a pixel.
#[derive(Debug, Clone, Copy)]
struct ColumnSums<const N: usize> {
    count: [f64; N],
    z: [f64; N],
    bz: [f64; N],
    zz: [f64; N],
    bzz: [f64; N],
    bbzz: [f64; N],
}

/// Sums up the points of every block in one pass over the depth (0 = no reading), in f64.
///
/// O(pixels), six multiplications a pixel, two or more columns at a time.
pub(super) fn sum_blocks(depth: &[f32], grid: &BlockGrid, rays: &Rays, out: &mut Vec<Moments>) {
    out.clear();
    out.resize(grid.len(), Moments::default());
    for (row, blocks) in out.chunks_exact_mut(grid.columns).enumerate() {
        let pixel_rows = grid.pixel_rows(row * grid.columns);
        let depths = &depth[pixel_rows.start * grid.width..pixel_rows.end * grid.width];
        let ray_y = &rays.y[pixel_rows];
        let paired = grid.width / 4 * 4;
        for u in (0..paired).step_by(4) {
            let sums = sum_columns::<4>(depths, grid.width, u, ray_y);
            add_columns(&sums, u, grid.side, &rays.x, blocks);
        }
        for u in paired..grid.width {
            let sums = sum_columns::<1>(depths, grid.width, u, ray_y);
            add_columns(&sums, u, grid.side, &rays.x, blocks);
        }
    }
}

/// Sums of columns u..u + N over some rows of the image.
#[inline]
fn sum_columns<const N: usize>(depths: &[f32], width: usize, u: usize, ray_y: &[f64]) -> ColumnSums<N> {
    let zero = [0.0; N];
    let mut sums = ColumnSums { count: zero, z: zero, bz: zero, zz: zero, bzz: zero, bbzz: zero };
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
fn add_columns<const N: usize>(
    sums: &ColumnSums<N>,
    u: usize,
    side: usize,
    ray_x: &[f64],
    blocks: &mut [Moments],
) {
    for k in 0..N {
        let a = ray_x[u + k];
        let azz = a * sums.zz[k];
        blocks[(u + k) / side].add(&Moments {
            weight: sums.count[k],
            first: [a * sums.z[k], sums.bz[k], sums.z[k]],
            second: [a * azz, a * sums.bzz[k], azz, sums.bbzz[k], sums.bzz[k], sums.zz[k]],
        });
    }
}

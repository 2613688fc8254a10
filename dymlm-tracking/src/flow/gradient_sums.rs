//! Gradients of a window, and the sums over them that all iterations of Lucas-Kanade share.

use wide::f32x4;

use super::shifted_sums::{LANES, sum_of, vectors};

/// Sums over a window's gradients.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GradientSums {
    /// Sums of the gradients times the window's grey values.
    pub(super) value: [f32; 2],
    /// Sums of products uu, uv and vv of the gradients.
    pub(super) matrix: [f32; 3],
}

impl GradientSums {
    /// The sums of given gradients, which are 0 in their padding.
    pub(super) fn of([gradient_u, gradient_v]: [&[f32]; 2], value: impl Fn(usize) -> f32) -> Self {
        let mut sums = [f32x4::ZERO; 3];
        for (gu, gv) in vectors(gradient_u).zip(vectors(gradient_v)) {
            sums[0] += gu * gu;
            sums[1] += gu * gv;
            sums[2] += gv * gv;
        }
        Self { value: [value(0), value(1)], matrix: sums.map(sum_of) }
    }
}

impl From<[f32x4; 5]> for GradientSums {
    fn from(sums: [f32x4; 5]) -> Self {
        let [u_value, v_value, uu, uv, vv] = sums.map(sum_of);
        Self { value: [u_value, v_value], matrix: [uu, uv, vv] }
    }
}

/// Computes Scharr's gradients of the row between two others, times `weights`, and adds this row to the sums
/// u value, v value, uu, uv, vv. The three rows begin one pixel before the gradients and have two pixels more;
/// `None` when one is shorter.
#[inline]
pub(super) fn add_gradients(
    sums: &mut [f32x4; 5],
    [above, here, below]: [&[f32]; 3],
    weights: &[f32],
    [gradient_u, gradient_v]: [&mut [f32]; 2],
) -> Option<()> {
    // Slices of one length: the loop then has a single condition.
    let count = weights.len();
    let rows = neighbours(above, count)?.zip(neighbours(here, count)?.zip(neighbours(below, count)?));
    let target_u = gradient_u.get_mut(..count)?.as_chunks_mut::<LANES>().0.iter_mut();
    let target_v = gradient_v.get_mut(..count)?.as_chunks_mut::<LANES>().0.iter_mut();
    let targets = target_u.zip(target_v).zip(vectors(weights));
    let [corner, side] = [3.0 / 32.0, 10.0 / 32.0].map(f32x4::splat);
    let mut own = *sums;
    for (([a0, a1, a2], ([h0, h1, h2], [b0, b1, b2])), ((target_u, target_v), weight)) in rows.zip(targets) {
        let gu = (corner * (a2 - a0 + b2 - b0) + side * (h2 - h0)) * weight;
        let gv = (corner * (b0 - a0 + b2 - a2) + side * (b1 - a1)) * weight;
        (*target_u, *target_v) = (gu.to_array(), gv.to_array());
        own[0] += gu * h1;
        own[1] += gv * h1;
        own[2] += gu * gu;
        own[3] += gu * gv;
        own[4] += gv * gv;
    }
    *sums = own;
    Some(())
}

/// The values of a row with those one and two pixels further.
#[inline]
fn neighbours(row: &[f32], count: usize) -> Option<impl Iterator<Item = [f32x4; 3]>> {
    let [first, second, third] = [row.get(..count)?, row.get(1..=count)?, row.get(2..count + 2)?];
    Some(vectors(first).zip(vectors(second)).zip(vectors(third)).map(|((a, b), c)| [a, b, c]))
}

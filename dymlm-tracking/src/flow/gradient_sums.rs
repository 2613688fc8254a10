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
/// u value, v value, uu, uv, vv. The three rows begin one pixel before the gradients and have two pixels
/// more; `None` when one is shorter.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_and_sums_are_those_of_the_definition() {
        let (count, rim) = (8, 12);
        let image: Vec<f32> = (0..5 * rim).map(|i| ((i * i * 37) % 101) as f32 * 0.01).collect();
        let weights: Vec<f32> = (0..count).map(|x| if x < 7 { 1.0 } else { 0.0 }).collect();
        let (mut sums, mut expected) = ([f32x4::ZERO; 5], [0.0_f32; 5]);
        for y in 0..3 {
            let rows = [0, 1, 2].map(|row| &image[(y + row) * rim..(y + row + 1) * rim]);
            let (mut gradient_u, mut gradient_v) = (vec![9.0; count], vec![9.0; count]);
            add_gradients(&mut sums, rows, &weights, [&mut gradient_u, &mut gradient_v]).unwrap();
            for x in 0..count {
                let at = |dx: usize, dy: usize| rows[dy][x + dx];
                let difference = |plus: [f32; 3], minus: [f32; 3]| -> f32 {
                    [3.0, 10.0, 3.0].iter().zip(plus).zip(minus).map(|((w, p), m)| w / 32.0 * (p - m)).sum()
                };
                let u = weights[x] * difference([0, 1, 2].map(|y| at(2, y)), [0, 1, 2].map(|y| at(0, y)));
                let v = weights[x] * difference([0, 1, 2].map(|x| at(x, 2)), [0, 1, 2].map(|x| at(x, 0)));
                assert!((gradient_u[x] - u).abs() < 1e-6 && (gradient_v[x] - v).abs() < 1e-6);
                let value = at(1, 1);
                for (sum, term) in expected.iter_mut().zip([u * value, v * value, u * u, u * v, v * v]) {
                    *sum += term;
                }
            }
        }
        let found = GradientSums::from(sums);
        for (found, expected) in found.value.iter().chain(&found.matrix).zip(expected) {
            assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
        }
        let short = [0.0; 9];
        let planes = (&mut [0.0; 8], &mut [0.0; 8]);
        assert_eq!(add_gradients(&mut sums, [&short; 3], &weights, [planes.0, planes.1]), None);
    }
}

//! Makes iterations of Lucas-Kanade cheap: sums over a window that moves by fractions of a pixel.

use wide::f32x4;

use super::sampling::Region;

/// Number of values that are processed at once.
pub(super) const LANES: usize = 4;

/// Sums of products of an image with two planes of a template, at the four whole-pixel shifts around a
/// corner.
///
/// An image between pixels is a blend of its four shifts, so a sum of products with it is the same blend of
/// four sums: `sum g(p) I(p + d) = sum over shifts s of w_s(d) sum g(p) I(p + s)`. While `d` stays between
/// the same pixels, the four sums stay the same, and an iteration costs four multiplications instead of a
/// pass over the window.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShiftedSums {
    /// For each plane, its sums at the shifts (0, 0), (1, 0), (0, 1) and (1, 1).
    sums: [[f32; 4]; 2],
}

impl ShiftedSums {
    /// The sums of planes with rows of `stride` values, a multiple of [`LANES`]; the region has one more
    /// column and one more row.
    pub(super) fn of(planes: [&[f32]; 2], stride: usize, region: Region<'_>) -> Self {
        let mut sums = [f32x4::ZERO; 8];
        let rows = planes[0].chunks_exact(stride).zip(planes[1].chunks_exact(stride));
        for (v, planes) in rows.enumerate() {
            let begin = v * region.stride;
            add_row(&mut sums, planes, region.data.get(begin..), region.data.get(begin + region.stride..));
        }
        let [a, b, c, d, e, f, g, h] = sums.map(sum_of);
        Self { sums: [[a, b, c, d], [e, f, g, h]] }
    }

    /// The sums of both planes with the image shifted by a fraction of a pixel from the corner.
    #[inline]
    pub(super) fn at(&self, [fx, fy]: [f32; 2]) -> [f32; 2] {
        let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
        self.sums.map(|sums| sums.iter().zip(weights).map(|(sum, weight)| sum * weight).sum())
    }
}

/// Adds the products of a row to the eight sums, which stay in registers; `None` when the image's rows are
/// shorter than the planes'.
#[inline]
fn add_row(
    sums: &mut [f32x4; 8],
    (first, second): (&[f32], &[f32]),
    upper: Option<&[f32]>,
    lower: Option<&[f32]>,
) -> Option<()> {
    // Slices of one length: the loop then has a single condition.
    let count = first.len();
    let (upper, lower) = (upper?, lower?);
    let upper = vectors(upper.get(..count)?).zip(vectors(upper.get(1..=count)?));
    let lower = vectors(lower.get(..count)?).zip(vectors(lower.get(1..=count)?));
    let planes = vectors(first).zip(vectors(second.get(..count)?));
    let mut own = *sums;
    for ((a, b), ((u0, u1), (l0, l1))) in planes.zip(upper.zip(lower)) {
        own[0] += a * u0;
        own[1] += a * u1;
        own[2] += a * l0;
        own[3] += a * l1;
        own[4] += b * u0;
        own[5] += b * u1;
        own[6] += b * l0;
        own[7] += b * l1;
    }
    *sums = own;
    Some(())
}

/// The values of a row, four at a time: without explicit vectors, the compiler mixes the lanes of
/// neighbouring sums.
#[inline]
pub(super) fn vectors(row: &[f32]) -> impl Iterator<Item = f32x4> {
    row.as_chunks::<LANES>().0.iter().map(|values| f32x4::from(*values))
}

/// Sums the lanes in an order that is the same on all processors.
#[inline]
pub(super) fn sum_of(lanes: f32x4) -> f32 {
    lanes.to_array().iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sums_are_those_of_the_image_between_its_pixels() {
        let image: Vec<f32> = (0..20 * 9).map(|i| ((i * 37) % 101) as f32 * 0.01).collect();
        let plane = |k: usize| -> Vec<f32> { (0..8 * 5).map(|i| ((i * k) % 17) as f32 - 8.0).collect() };
        let planes = [plane(5), plane(11)];
        let first = 2 * 20 + 3;
        let region = Region { data: &image[first..], stride: 20 };
        let sums = ShiftedSums::of([&planes[0], &planes[1]], 8, region);
        for fraction in [[0.0, 0.0], [0.3, 0.8], [0.99, 0.01]] {
            let [fx, fy] = fraction;
            let seen = |i: usize| {
                let at = |shift: usize| image[first + i / 8 * 20 + i % 8 + shift];
                let [upper, lower] = [0, 20].map(|row| at(row) + fx * (at(row + 1) - at(row)));
                upper + fy * (lower - upper)
            };
            for (plane, sum) in planes.iter().zip(sums.at(fraction)) {
                let expected: f32 = plane.iter().enumerate().map(|(i, value)| value * seen(i)).sum();
                assert!((sum - expected).abs() < 1e-3, "{sum} instead of {expected}");
            }
        }
    }
}

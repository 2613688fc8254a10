//! Values of an image between its pixels and beyond its border.

use wide::f32x4;

use super::shifted_sums::{LANES, vectors};
use crate::GrayImage;

/// A part of an image, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region<'a> {
    pub(super) data: &'a [f32],
    pub(super) stride: usize,
}

/// A window of an image whose pixels lie between those of the image: values at steps of one pixel from a
/// corner, bilinearly interpolated. The image's border is repeated outside it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interpolated<'a> {
    region: Region<'a>,
    /// Weights of the pixel to the upper left, its right neighbour, and the two below.
    weights: [f32x4; 4],
}

impl<'a> Interpolated<'a> {
    /// The window of `size` values from `corner`; `patch` is working memory.
    pub(super) fn new(
        image: &'a GrayImage,
        corner: [f32; 2],
        size: [usize; 2],
        patch: &'a mut Vec<f32>,
    ) -> Self {
        let floor = corner.map(f32::floor);
        let [fx, fy] = [corner[0] - floor[0], corner[1] - floor[1]];
        let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];
        let region = region(image, floor.map(|c| c as isize), size, patch);
        Self { region, weights: weights.map(f32x4::splat) }
    }

    /// Fills `row`, whose length is a multiple of [`LANES`], with the first values of row `v`;
    /// `None` when the window has fewer.
    #[inline]
    pub(super) fn read(&self, v: usize, row: &mut [f32]) -> Option<()> {
        let Region { data, stride } = self.region;
        // Slices of one length: the loop then has a single condition.
        let (begin, count) = (v * stride, row.len());
        let (upper, lower) = (data.get(begin..)?, data.get(begin + stride..)?);
        let upper = vectors(upper.get(..count)?).zip(vectors(upper.get(1..=count)?));
        let lower = vectors(lower.get(..count)?).zip(vectors(lower.get(1..=count)?));
        let [wa, wb, wc, wd] = self.weights;
        for (values, ((a, b), (c, d))) in row.as_chunks_mut::<LANES>().0.iter_mut().zip(upper.zip(lower)) {
            *values = (wa * a + wb * b + wc * c + wd * d).to_array();
        }
        Some(())
    }
}

/// The given columns and rows of pixels from (`x`, `y`), plus one of each; the border is repeated outside the
/// image.
pub(super) fn region<'a>(
    image: &'a GrayImage,
    [x, y]: [isize; 2],
    [columns, rows]: [usize; 2],
    patch: &'a mut Vec<f32>,
) -> Region<'a> {
    let is_inside =
        x >= 0 && y >= 0 && x as usize + columns < image.width() && y as usize + rows < image.height();
    if is_inside {
        let first = y as usize * image.width() + x as usize;
        return Region { data: image.data().get(first..).unwrap_or(&[]), stride: image.width() };
    }
    copy_clamped(image, [x, y], [columns + 1, rows + 1], patch);
    Region { data: patch, stride: columns + 1 }
}

fn copy_clamped(image: &GrayImage, [x, y]: [isize; 2], [columns, rows]: [usize; 2], patch: &mut Vec<f32>) {
    // The columns to the left of the image, those in it, and the image's columns that they show.
    let limit = |u: isize| u.clamp(0, image.width() as isize) as usize;
    let left = x.saturating_neg().clamp(0, columns as isize) as usize;
    let shown = limit(x)..limit(x.saturating_add(columns as isize));
    patch.resize(columns * rows, 0.0);
    for (v, target) in patch.chunks_exact_mut(columns.max(1)).enumerate() {
        let row = image.clamped_row(y.saturating_add(v as isize));
        let (Some(&first), Some(&last)) = (row.first(), row.last()) else { return };
        let (before, rest) = target.split_at_mut(left);
        before.fill(first);
        let (inside, after) = rest.split_at_mut(shown.len().min(rest.len()));
        let row = row.get(shown.clone()).unwrap_or(&[]);
        inside.iter_mut().zip(row).for_each(|(target, value)| *target = *value);
        after.fill(last);
    }
}

/// The bilinear value at a point; outside the image, that of the nearest border point.
pub(super) fn bilinear(image: &GrayImage, [u, v]: [f32; 2]) -> f32 {
    let (u, v) = (u.clamp(0.0, (image.width() - 1) as f32), v.clamp(0.0, (image.height() - 1) as f32));
    let (x, y) = (u as usize, v as usize);
    let (fu, fv) = (u - x as f32, v - y as f32);
    let [upper, lower] = [y, y + 1].map(|y| {
        let row = image.clamped_row(y as isize);
        row[x] + fu * (row[(x + 1).min(row.len() - 1)] - row[x])
    });
    upper + fv * (lower - upper)
}

/// The value of the nearest pixel; 0 outside the image.
pub(super) fn nearest(image: &GrayImage, [u, v]: [f32; 2]) -> f32 {
    if u < -0.5 || v < -0.5 {
        return 0.0;
    }
    image.at((u + 0.5) as usize, (v + 0.5) as usize)
}

/// Whether a point lies on the image; NaN does not.
pub(super) fn is_within(image: &GrayImage, [u, v]: [f32; 2]) -> bool {
    (-0.5..image.width() as f32 - 0.5).contains(&u) && (-0.5..image.height() as f32 - 0.5).contains(&v)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves() -> GrayImage {
        let value = |i: usize| {
            let (u, v) = ((i % 64) as f32, (i / 64) as f32);
            0.5 + 0.2 * (0.37 * u + 0.11 * v).sin() + 0.2 * (0.29 * v - 0.07 * u).cos()
        };
        GrayImage::new(64, 64, (0..64 * 64).map(value).collect()).unwrap()
    }

    #[test]
    fn windows_across_the_border_repeat_it() {
        let image = waves();
        let mut patch = Vec::new();
        for corner in [[-3.5, -2.0], [59.25, 61.5], [-3.0, 62.75], [-40.5, 20.5], [90.0, -33.0]] {
            let window = Interpolated::new(&image, corner, [8, 6], &mut patch);
            for row in 0..6 {
                let mut values = [0.0; 8];
                window.read(row, &mut values);
                for (column, value) in values.iter().enumerate() {
                    let expected = bilinear(&image, [column as f32 + corner[0], row as f32 + corner[1]]);
                    assert!((value - expected).abs() < 1e-6, "{corner:?}: {value} is not {expected}");
                }
            }
        }
    }
}

//! Values of an image between its pixels and beyond its border.

use crate::GrayImage;

/// A part of an image, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Region<'a> {
    pub(super) data: &'a [f32],
    pub(super) stride: usize,
}

impl Region<'_> {
    /// The first `count` values of row `v`; empty when the region has fewer.
    #[inline]
    pub(super) fn row(&self, v: usize, count: usize) -> &[f32] {
        let begin = v * self.stride;
        self.data.get(begin..begin + count).unwrap_or(&[])
    }
}

/// Most values of an interpolated row: the widest window with its rim and padding.
const MOST_COLUMNS: usize = 40;

/// Samples `size[0]` x `size[1]` values bilinearly at steps of one pixel from `corner`, and passes each row
/// to `row_done`. The image's border is repeated outside it; `patch` is working memory for that.
#[inline]
pub(super) fn interpolate(
    image: &GrayImage,
    corner: [f32; 2],
    [columns, rows]: [usize; 2],
    patch: &mut Vec<f32>,
    mut row_done: impl FnMut(usize, &mut [f32]),
) {
    let floor = corner.map(f32::floor);
    let [x, y] = floor.map(|c| c as isize);
    let [fx, fy] = [corner[0] - floor[0], corner[1] - floor[1]];
    let weights = [(1.0 - fx) * (1.0 - fy), fx * (1.0 - fy), (1.0 - fx) * fy, fx * fy];

    let Region { data, stride } = region(image, [x, y], [columns, rows], patch);
    let mut buffer = [0.0_f32; MOST_COLUMNS];
    let Some(row) = buffer.get_mut(..columns) else { return };
    for v in 0..rows {
        let begin = v * stride;
        let (Some(upper), Some(lower)) =
            (data.get(begin..=begin + columns), data.get(begin + stride..=begin + stride + columns))
        else {
            return;
        };
        let corners = upper.iter().zip(&upper[1..]).zip(lower.iter().zip(&lower[1..]));
        for (value, ((a, b), (c, d))) in row.iter_mut().zip(corners) {
            *value = weights[0] * a + weights[1] * b + weights[2] * c + weights[3] * d;
        }
        row_done(v, row);
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
    patch.clear();
    let last = image.width() as isize - 1;
    for v in 0..rows {
        let row = image.clamped_row(y.saturating_add(v as isize));
        patch.extend((0..columns).map(|u| row[x.saturating_add(u as isize).clamp(0, last) as usize]));
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
        interpolate(&image, [-3.5, -2.0], [8, 6], &mut patch, |row, values| {
            for (column, value) in values.iter().enumerate() {
                let expected = bilinear(&image, [column as f32 - 3.5, row as f32 - 2.0]);
                assert!((value - expected).abs() < 1e-6);
            }
        });
    }
}

use std::ops::Range;

use wide::f32x4;

use super::lanes::LANES;
use crate::GrayImage;

/// Resamples a window of an image to a template. A triangle filter as wide as a template pixel prevents
/// aliasing of fine texture. Outside the image its border is repeated.
///
/// Rows are blended first, over whole ranges of columns; then the columns of four rows at once. O(rows of the
/// template x (columns of the window + columns of the template)).
#[derive(Debug, Clone, Default)]
pub(super) struct WindowSampler {
    columns: Taps,
    rows: Taps,
    /// Four rows of the template in the image's columns: as far as the image reaches, then side by side in
    /// lanes with the border repeated, then in the template's columns.
    blended: [Vec<f32>; LANES],
    wide: Vec<f32x4>,
    resampled: Vec<f32x4>,
}

/// For each template pixel, the source pixels that it blends: `weights[start..end]` apply from `first` on.
#[derive(Debug, Clone, Default)]
struct Taps {
    spans: Vec<Span>,
    weights: Vec<f32>,
}

#[derive(Debug, Clone, Copy)]
struct Span {
    first: isize,
    start: usize,
    end: usize,
}

impl WindowSampler {
    /// Fills `template`, in rows of `size[0]` pixels, from the window of `extent` pixels around `center`.
    pub(super) fn sample(
        &mut self,
        image: &GrayImage,
        center: [f32; 2],
        extent: [f32; 2],
        size: [usize; 2],
        template: &mut [f32],
    ) {
        self.columns.prepare(center[0], extent[0], size[0], image.width());
        self.rows.prepare(center[1], extent[1], size[1], image.height());
        let (Some(&left), Some(&right)) = (self.columns.spans.first(), self.columns.spans.last()) else {
            return;
        };
        // The columns that the template needs, and those of them that the image has (or its border).
        let [begin, end] = [left.first, right.first + (right.end - right.start) as isize];
        let last = image.width().saturating_sub(1) as isize;
        let [first_shown, last_shown] = [begin, end - 1].map(|column| column.clamp(0, last));
        let shown = first_shown as usize..(last_shown + 1) as usize;
        self.resampled.resize(size[0], f32x4::ZERO);
        for (band, spans) in template.chunks_mut(LANES * size[0]).zip(self.rows.spans.chunks(LANES)) {
            for (lane, blended) in self.blended.iter_mut().enumerate() {
                // The last band may have fewer rows: its last one is repeated, and not used.
                if let Some(&span) = spans.get(lane).or(spans.last()) {
                    self.rows.blend_rows(image, span, shown.clone(), blended);
                }
            }
            widen(&self.blended, (first_shown - begin, (end - begin) as usize), &mut self.wide);
            self.columns.blend_columns(&self.wide, &mut self.resampled);
            for (lane, row) in band.chunks_exact_mut(size[0]).enumerate() {
                for (value, values) in row.iter_mut().zip(&self.resampled) {
                    *value = values.to_array()[lane];
                }
            }
        }
    }
}

/// Puts rows side by side in lanes and repeats their ends: `count` values, of which `left` lie before the
/// rows (or the rows begin before them, when `left` is negative).
fn widen(rows: &[Vec<f32>; LANES], (left, count): (isize, usize), wide: &mut Vec<f32x4>) {
    let [a, b, c, d] = rows;
    let all = a.iter().zip(b).zip(c).zip(d).map(|(((a, b), c), d)| f32x4::new([*a, *b, *c, *d]));
    let (Some(first), Some(last)) = (all.clone().next(), all.clone().next_back()) else { return };
    let before = left.clamp(0, count as isize) as usize;
    let skipped = left.saturating_neg().max(0) as usize;
    wide.clear();
    wide.resize(before, first);
    wide.extend(all.skip(skipped).take(count - before));
    wide.resize(count, last);
}

impl Taps {
    fn prepare(&mut self, center: f32, extent: f32, size: usize, length: usize) {
        self.spans.clear();
        self.weights.clear();
        let scale = extent / size as f32;
        let support = scale.max(1.0);
        // Taps far outside the image would only repeat its border.
        let limit = length as f32 + support;
        for i in 0..size {
            let at = (center + (i as f32 + 0.5 - 0.5 * size as f32) * scale).clamp(-1.0 - support, limit);
            let first = (at - support).floor() as isize + 1;
            let last = (at + support).ceil() as isize - 1;
            let start = self.weights.len();
            self.weights
                .extend((first..=last.max(first)).map(|j| (1.0 - (j as f32 - at).abs() / support).max(1e-6)));
            let sum: f32 = self.weights.iter().skip(start).sum();
            self.weights.iter_mut().skip(start).for_each(|weight| *weight /= sum);
            self.spans.push(Span { first, start, end: self.weights.len() });
        }
    }

    /// Blends the image's rows of one span, in the given columns.
    fn blend_rows(&self, image: &GrayImage, span: Span, columns: Range<usize>, blended: &mut Vec<f32>) {
        blended.clear();
        blended.resize(columns.len(), 0.0);
        let weights = self.weights.get(span.start..span.end).unwrap_or(&[]);
        for (v, &weight) in (span.first..).zip(weights) {
            let source = image.clamped_row(v).get(columns.clone()).unwrap_or(&[]);
            for (sum, &value) in blended.iter_mut().zip(source) {
                *sum += weight * value;
            }
        }
    }

    /// Blends columns, of which the first value is that of the first span.
    fn blend_columns(&self, values: &[f32x4], targets: &mut [f32x4]) {
        let Some(begin) = self.spans.first().map(|span| span.first) else { return };
        for (target, span) in targets.iter_mut().zip(&self.spans) {
            let first = (span.first - begin) as usize;
            let weights = self.weights.get(span.start..span.end).unwrap_or(&[]);
            let values = values.get(first..first + weights.len()).unwrap_or(&[]);
            *target = if let ([a, b], [left, right]) = (values, weights) {
                // The common case: most templates are no coarser than the image.
                f32x4::splat(*left) * a + f32x4::splat(*right) * b
            } else {
                weights.iter().zip(values).map(|(weight, value)| f32x4::splat(*weight) * value).sum()
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> GrayImage {
        GrayImage::new(20, 10, (0..200).map(|i| (i % 20) as f32 + 0.1 * (i / 20) as f32).collect()).unwrap()
    }

    #[test]
    fn a_window_of_the_templates_size_is_a_copy() {
        let mut template = vec![0.0; 16];
        WindowSampler::default().sample(&ramp(), [6.5, 4.5], [4.0, 4.0], [4, 4], &mut template);
        for (i, value) in template.iter().enumerate() {
            let expected = (5 + i % 4) as f32 + 0.1 * (3 + i / 4) as f32;
            assert!((value - expected).abs() < 1e-4, "{i}: {value} is not {expected}");
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_at_any_scale() {
        for extent in [3.0, 4.0, 7.3] {
            let mut template = vec![0.0; 16];
            WindowSampler::default().sample(&ramp(), [9.7, 4.5], [extent, 2.0], [4, 4], &mut template);
            for (i, value) in template.iter().take(4).enumerate() {
                let expected = 9.7 + (i as f32 - 1.5) * extent / 4.0;
                // (The triangle's weights are sampled at whole pixels, so they are exact only on average.)
                assert!(
                    (value - 0.1 * 3.75 - expected).abs() < 0.1,
                    "{extent}, {i}: {value} is not {expected}"
                );
            }
        }
    }

    #[test]
    fn outside_the_border_is_repeated() {
        let mut template = vec![0.0; 16];
        for center in [[-500.0, -1e9], [1e9, 700.0], [0.0, 0.0]] {
            WindowSampler::default().sample(&ramp(), center, [40.0, 1e6], [4, 4], &mut template);
            assert!(template.iter().all(|value| (-1e-3..=20.0).contains(value)));
        }
    }

    /// Sizes that are no multiple of four, windows across each border and wholly outside.
    #[test]
    fn each_pixel_is_the_sum_over_its_taps() {
        let image = ramp();
        let mut sampler = WindowSampler::default();
        for (center, extent, size) in [
            ([9.3, 4.1], [5.0, 6.0], [7, 9]),
            ([-3.0, 2.0], [9.0, 30.0], [7, 5]),
            ([25.0, 12.0], [12.0, 6.0], [5, 10]),
            ([-80.0, 4.0], [12.0, 3.0], [6, 6]),
            ([90.0, 50.0], [30.0, 3.0], [6, 7]),
            ([9.3, 4.1], [60.0, 22.0], [6, 7]),
        ] {
            let mut template = vec![9.0; size[0] * size[1]];
            sampler.sample(&image, center, extent, size, &mut template);
            let taps = |taps: &Taps, i: usize| -> Vec<(isize, f32)> {
                let span = taps.spans[i];
                (span.first..).zip(taps.weights[span.start..span.end].iter().copied()).collect()
            };
            for (i, value) in template.iter().enumerate() {
                let mut expected = 0.0;
                for (v, row_weight) in taps(&sampler.rows, i / size[0]) {
                    for (u, weight) in taps(&sampler.columns, i % size[0]) {
                        let pixel = image.at(u.clamp(0, 19) as usize, v.clamp(0, 9) as usize);
                        expected += row_weight * weight * pixel;
                    }
                }
                assert!((value - expected).abs() < 1e-4, "{center:?}, {i}: {value} is not {expected}");
            }
        }
    }
}

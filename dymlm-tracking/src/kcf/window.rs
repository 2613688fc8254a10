use crate::GrayImage;

/// Resamples a window of an image to a template. A triangle filter as wide as a template pixel prevents
/// aliasing of fine texture. Outside the image its border is repeated.
///
/// Rows are blended first, over whole ranges of columns: O(rows of the window x its columns + template).
#[derive(Debug, Clone, Default)]
pub(super) struct WindowSampler {
    columns: Taps,
    rows: Taps,
    blended: Vec<f32>,
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
        // The range of image columns that the template needs.
        let last = image.width().saturating_sub(1) as isize;
        let begin = left.first.clamp(0, last);
        let end = (right.first + (right.end - right.start) as isize - 1).clamp(0, last) + 1;
        let columns = begin as usize..end as usize;

        for (row, span) in template.chunks_exact_mut(size[0]).zip(&self.rows.spans) {
            let weights = self.rows.weights.get(span.start..span.end).unwrap_or(&[]);
            self.blended.clear();
            self.blended.resize(columns.len(), 0.0);
            for (v, &weight) in (span.first..).zip(weights) {
                let source = image.clamped_row(v).get(columns.clone()).unwrap_or(&[]);
                for (sum, &value) in self.blended.iter_mut().zip(source) {
                    *sum += weight * value;
                }
            }
            self.columns.blend(&self.blended, begin, row);
        }
    }
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

    /// Blends the columns of one row, whose first value is column `begin` of the image.
    fn blend(&self, values: &[f32], begin: isize, row: &mut [f32]) {
        let Some(last) = values.len().checked_sub(1) else { return };
        for (value, span) in row.iter_mut().zip(&self.spans) {
            let weights = self.weights.get(span.start..span.end).unwrap_or(&[]);
            let first = span.first - begin;
            let inside =
                usize::try_from(first).ok().and_then(|first| values.get(first..first + weights.len()));
            *value = if let (Some([a, b]), [left, right]) = (inside, weights) {
                // The common case: most templates are no coarser than the image.
                left * a + right * b
            } else if let Some(inside) = inside {
                weights.iter().zip(inside).map(|(weight, value)| weight * value).sum()
            } else {
                let clamped = |k: usize| values[(first + k as isize).clamp(0, last as isize) as usize];
                weights.iter().enumerate().map(|(k, weight)| weight * clamped(k)).sum()
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
}

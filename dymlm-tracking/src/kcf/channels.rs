use rustfft::num_complex::Complex;

use super::fhog::{CHANNELS, Fhog};

/// Number of channels: Felzenszwalb's histograms of oriented gradients, and the mean intensity.
pub(super) const COUNT: usize = CHANNELS + 1;
/// Number of packed planes.
pub(super) const PLANES: usize = COUNT.div_ceil(2);

/// Turns templates into channels under a cosine window. Two channels are packed as real and imaginary part of
/// one plane, which halves the number of transforms and leaves the sums of products over all channels the
/// same (see `correlation`).
#[derive(Debug, Clone)]
pub(super) struct Channels {
    cells: [usize; 2],
    cell: usize,
    fhog: Fhog,
    /// Cosine window: one weight per cell.
    taper: Vec<f32>,
    values: Vec<f32>,
}

impl Channels {
    pub(super) fn new(cells: [usize; 2], cell: usize) -> Self {
        let [across, down] = cells.map(hann);
        let taper = down.iter().flat_map(|y| across.iter().map(move |x| x * y)).collect();
        let values = vec![0.0; COUNT * cells[0] * cells[1]];
        Self { cells, cell, fhog: Fhog::new(cells, cell), taper, values }
    }

    /// Computes the channels of a template, tapered and packed.
    pub(super) fn compute(&mut self, template: &[f32], packed: &mut [Complex<f32>]) {
        let count = self.taper.len();
        let (gradients, intensity) = self.values.split_at_mut(CHANNELS * count);
        self.fhog.compute(template, gradients);
        mean_intensity(template, self.cells, self.cell, intensity);
        for (plane, pair) in packed.chunks_exact_mut(count).zip(self.values.chunks(2 * count)) {
            let (real, imaginary) = pair.split_at(count);
            for ((target, &value), &weight) in plane.iter_mut().zip(real).zip(&self.taper) {
                *target = Complex::new(weight * value, 0.0);
            }
            for ((target, &value), &weight) in plane.iter_mut().zip(imaginary).zip(&self.taper) {
                target.im = weight * value;
            }
        }
    }
}

/// Mean of each cell minus the mean of the template.
fn mean_intensity(template: &[f32], cells: [usize; 2], cell: usize, values: &mut [f32]) {
    let width = cells[0] * cell;
    let weight = 1.0 / (cell * cell) as f32;
    values.fill(0.0);
    let bands = template.chunks_exact(width * cell).zip(values.chunks_exact_mut(cells[0]));
    for (band, sums) in bands {
        for row in band.chunks_exact(width) {
            for (pixels, sum) in row.chunks_exact(cell).zip(sums.iter_mut()) {
                *sum += weight * pixels.iter().sum::<f32>();
            }
        }
    }
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    for value in values {
        *value -= mean;
    }
}

/// Hann's window of `count` weights, which would be 0 one step outside either end.
fn hann(count: usize) -> Vec<f32> {
    let phase = |i: usize| std::f32::consts::TAU * (i as f32 + 1.0) / (count as f32 + 1.0);
    (0..count).map(|i| 0.5 - 0.5 * phase(i).cos()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_are_packed_in_pairs_under_the_window() {
        let template: Vec<f32> = (0..256).map(|i| (i * 31 % 17) as f32 / 17.0).collect();
        let mut channels = Channels::new([4, 4], 4);
        let mut packed = vec![Complex::default(); PLANES * 16];
        channels.compute(&template, &mut packed);
        for c in 0..2 * PLANES {
            for cell in 0..16 {
                let plane = packed[c / 2 * 16 + cell];
                let value = if c % 2 == 0 { plane.re } else { plane.im };
                let expected =
                    channels.values.get(c * 16 + cell).map_or(0.0, |value| value * channels.taper[cell]);
                assert_eq!(value, expected);
            }
        }
    }

    #[test]
    fn the_window_is_symmetric_and_highest_in_the_middle() {
        let weights = hann(7);
        assert!((weights[3] - 1.0).abs() < 1e-6);
        for i in 0..3 {
            assert!((weights[i] - weights[6 - i]).abs() < 1e-6 && weights[i] < weights[i + 1]);
        }
    }
}

use rustfft::num_complex::Complex;
use wide::f32x4;

use super::fhog::{CELL, Fhog, VECTORS};
use super::lanes::{LANES, Lanes};

/// Number of channels: Felzenszwalb's histograms of oriented gradients, and the mean intensity.
pub(super) const COUNT: usize = VECTORS * LANES;
/// Number of packed planes.
pub(super) const PLANES: usize = VECTORS / 2;

/// Turns templates into channels under a cosine window. Four channels lie in the lanes of a plane's real part
/// and four in those of its imaginary part, which divides the number of transforms by eight and leaves the
/// sums of products over all channels the same (see `correlation`).
#[derive(Debug, Clone)]
pub(super) struct Channels {
    cells: [usize; 2],
    fhog: Fhog,
    /// Cosine window: one weight per cell.
    taper: Vec<f32>,
    intensity: Vec<f32>,
}

impl Channels {
    pub(super) fn new(cells: [usize; 2]) -> Self {
        let [across, down] = cells.map(hann);
        let taper = down.iter().flat_map(|y| across.iter().map(move |x| x * y)).collect();
        Self { cells, fhog: Fhog::new(cells), taper, intensity: vec![0.0; cells[0] * cells[1]] }
    }

    /// Computes the channels of a template, tapered and packed.
    pub(super) fn compute(&mut self, template: &[f32], packed: &mut [Complex<Lanes>]) {
        mean_intensity(template, self.cells, &mut self.intensity);
        let count = self.taper.len();
        let mut cells = self.taper.iter().zip(&self.intensity).enumerate();
        self.fhog.compute(template, |mut channels| {
            let Some((cell, (&taper, &intensity))) = cells.next() else { return };
            // The last place of the last vector but one is free.
            channels[VECTORS - 2] += f32x4::new([0.0, 0.0, 0.0, intensity]);
            for (plane, [real, imaginary]) in channels.as_chunks().0.iter().enumerate() {
                if let Some(target) = packed.get_mut(plane * count + cell) {
                    *target = Complex::new(Lanes(*real * taper), Lanes(*imaginary * taper));
                }
            }
        });
    }
}

/// Mean of each cell minus the mean of the template.
fn mean_intensity(template: &[f32], cells: [usize; 2], values: &mut [f32]) {
    let width = cells[0] * CELL;
    let weight = 1.0 / (CELL * CELL) as f32;
    values.fill(0.0);
    let bands = template.chunks_exact(width * CELL).zip(values.chunks_exact_mut(cells[0]));
    for (band, sums) in bands {
        for row in band.chunks_exact(width) {
            for (pixels, sum) in row.as_chunks::<CELL>().0.iter().zip(sums.iter_mut()) {
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
    fn channels_and_intensity_are_packed_under_the_window() {
        let template: Vec<f32> = (0..256).map(|i| (i * 31 % 17) as f32 / 17.0).collect();
        let mut channels = Channels::new([4, 4]);
        let mut packed = vec![Complex::new(Lanes::splat(9.0), Lanes::splat(9.0)); PLANES * 16];
        channels.compute(&template, &mut packed);
        let mut expected = Vec::new();
        Fhog::new([4, 4]).compute(&template, |vectors| expected.push(vectors));
        let overall = template.iter().sum::<f32>() / 256.0;
        for (cell, vectors) in expected.iter().enumerate() {
            let pixels = (0..16).map(|i| template[(cell / 4 * 4 + i / 4) * 16 + cell % 4 * 4 + i % 4]);
            let intensity = pixels.sum::<f32>() / 16.0 - overall;
            for (c, &value) in vectors.iter().flat_map(f32x4::as_array).enumerate() {
                let plane = packed[c / 8 * 16 + cell];
                let found = if c / 4 % 2 == 0 { plane.re } else { plane.im };
                let value = if c == 27 { intensity } else { value };
                assert!((found.0.to_array()[c % 4] - value * channels.taper[cell]).abs() < 1e-6);
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

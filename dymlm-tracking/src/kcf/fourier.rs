use std::fmt;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::num_traits::Zero;
use rustfft::{Fft, FftDirection, FftNum};

use super::transform::transform;

/// Two-dimensional Fourier transforms of planes of one size, of single numbers or of
/// [`Lanes`](super::lanes::Lanes). Spectra are stored column by column: transposing them back is not needed.
#[derive(Clone)]
pub(super) struct Fourier<T: FftNum> {
    size: [usize; 2],
    rows: Arc<dyn Fft<T>>,
    columns: Arc<dyn Fft<T>>,
    inverse_rows: Arc<dyn Fft<T>>,
    inverse_columns: Arc<dyn Fft<T>>,
    scratch: Vec<Complex<T>>,
    turned: Vec<Complex<T>>,
}

impl<T: FftNum> Fourier<T> {
    /// For planes of `size[0]` columns and `size[1]` rows.
    pub(super) fn new(size: [usize; 2]) -> Self {
        let [width, height] = size;
        let [rows, columns] = size.map(|length| transform(length, FftDirection::Forward));
        let [inverse_rows, inverse_columns] = size.map(|length| transform(length, FftDirection::Inverse));
        let plans = [&rows, &columns, &inverse_rows, &inverse_columns];
        let scratch = plans
            .iter()
            .map(|plan| plan.get_inplace_scratch_len().max(plan.get_outofplace_scratch_len()))
            .max()
            .unwrap_or(0);
        Self {
            size,
            scratch: vec![Complex::zero(); scratch],
            turned: vec![Complex::zero(); width * height],
            rows,
            columns,
            inverse_rows,
            inverse_columns,
        }
    }

    /// Transforms consecutive planes, each in place.
    pub(super) fn forward(&mut self, planes: &mut [Complex<T>]) {
        for plane in planes.chunks_exact_mut(self.size[0] * self.size[1]) {
            self.rows.process_with_scratch(plane, &mut self.scratch);
            transpose(plane, &mut self.turned, self.size[0]);
            self.columns.process_outofplace_with_scratch(&mut self.turned, plane, &mut self.scratch);
        }
    }

    /// The inverse of [`Self::forward`] for one spectrum, in place, not normalized: times the number of
    /// values.
    pub(super) fn inverse(&mut self, spectrum: &mut [Complex<T>]) {
        self.inverse_columns.process_with_scratch(spectrum, &mut self.scratch);
        transpose(spectrum, &mut self.turned, self.size[1]);
        self.inverse_rows.process_outofplace_with_scratch(&mut self.turned, spectrum, &mut self.scratch);
    }
}

/// Transposes: rows of `width` values become columns.
fn transpose<T: FftNum>(plane: &[Complex<T>], turned: &mut [Complex<T>], width: usize) {
    let height = plane.len() / width;
    for (y, row) in plane.chunks_exact(width).enumerate() {
        for (value, target) in row.iter().zip(turned.iter_mut().skip(y).step_by(height)) {
            *target = *value;
        }
    }
}

impl<T: FftNum> fmt::Debug for Fourier<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Fourier").field("size", &self.size).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use wide::f32x4;

    use super::*;
    use crate::kcf::lanes::{LANES, Lanes};

    #[test]
    fn there_and_back_is_where_it_was() {
        let mut fourier = Fourier::new([6, 4]);
        let original: Vec<Complex<f32>> =
            (0..48).map(|i| Complex::new((i * 7 % 11) as f32, (i * 5 % 13) as f32)).collect();
        let mut planes = original.clone();
        fourier.forward(&mut planes);
        planes.chunks_exact_mut(24).for_each(|plane| fourier.inverse(plane));
        for (a, b) in planes.iter().zip(&original) {
            assert!((a / 24.0 - b).norm() < 1e-4);
        }
    }

    #[test]
    fn agrees_with_the_definition() {
        let (w, h) = (6, 4);
        let original: Vec<Complex<f32>> = (0..24).map(|i| Complex::new((i * 7 % 11) as f32, 0.0)).collect();
        let mut plane = original.clone();
        Fourier::new([w, h]).forward(&mut plane);
        for kx in 0..w {
            for ky in 0..h {
                let mut sum = Complex::new(0.0, 0.0);
                for (i, value) in original.iter().enumerate() {
                    let turns = kx as f32 * (i % w) as f32 / w as f32 + ky as f32 * (i / w) as f32 / h as f32;
                    sum += value * Complex::from_polar(1.0, -std::f32::consts::TAU * turns);
                }
                assert!((plane[kx * h + ky] - sum).norm() < 1e-3);
            }
        }
    }

    #[test]
    fn lanes_are_separate_transforms() {
        let size = [10, 6];
        let plane = |lane: usize| -> Vec<Complex<f32>> {
            (0..60)
                .map(|i| Complex::new((i * (7 + lane) % 11) as f32, (i * (3 + lane) % 13) as f32))
                .collect()
        };
        let lanes = |part: fn(Complex<f32>) -> f32, i: usize| {
            Lanes(f32x4::new(std::array::from_fn(|lane| part(plane(lane)[i]))))
        };
        let mut packed: Vec<Complex<Lanes>> =
            (0..60).map(|i| Complex::new(lanes(|z| z.re, i), lanes(|z| z.im, i))).collect();
        Fourier::new(size).forward(&mut packed);
        for lane in 0..LANES {
            let mut alone = plane(lane);
            Fourier::new(size).forward(&mut alone);
            for (packed, alone) in packed.iter().zip(alone) {
                let found = Complex::new(packed.re.0.to_array()[lane], packed.im.0.to_array()[lane]);
                assert!((found - alone).norm() < 1e-4, "lane {lane}: {found} is not {alone}");
            }
        }
    }
}

use std::fmt;
use std::sync::Arc;

use rustfft::algorithm::butterflies::{
    Butterfly2, Butterfly3, Butterfly4, Butterfly5, Butterfly6, Butterfly8, Butterfly9, Butterfly12,
    Butterfly16, Butterfly24, Butterfly27, Butterfly32,
};
use rustfft::algorithm::{Dft, MixedRadixSmall};
use rustfft::num_complex::Complex;
use rustfft::num_traits::Zero;
use rustfft::{Fft, FftDirection, FftNum};

/// Lengths of the transforms that `rustfft` has written out, of those that [`fast_length`] is made of.
const WRITTEN_OUT: [usize; 12] = [2, 3, 4, 5, 6, 8, 9, 12, 16, 24, 27, 32];

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

/// A transform of one length, fast where that is a [`fast_length`].
///
/// `rustfft`'s planner does the same for every length, but the transforms that it might choose are then all compiled:
/// for single numbers and for lanes they were more than half of this crate's code.
fn transform<T: FftNum>(length: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    match length {
        2 => Arc::new(Butterfly2::new(direction)),
        3 => Arc::new(Butterfly3::new(direction)),
        4 => Arc::new(Butterfly4::new(direction)),
        5 => Arc::new(Butterfly5::new(direction)),
        6 => Arc::new(Butterfly6::new(direction)),
        8 => Arc::new(Butterfly8::new(direction)),
        9 => Arc::new(Butterfly9::new(direction)),
        12 => Arc::new(Butterfly12::new(direction)),
        16 => Arc::new(Butterfly16::new(direction)),
        24 => Arc::new(Butterfly24::new(direction)),
        27 => Arc::new(Butterfly27::new(direction)),
        32 => Arc::new(Butterfly32::new(direction)),
        _ => match factors(length) {
            Some(factors) => {
                let [rows, columns] = factors.map(|factor| transform(factor, direction));
                Arc::new(MixedRadixSmall::new(rows, columns))
            }
            None => Arc::new(Dft::new(length, direction)),
        },
    }
}

/// Two factors of a length, the first of them written out: if possible both, and then as alike as they can be.
fn factors(length: usize) -> Option<[usize; 2]> {
    let pairs =
        WRITTEN_OUT.into_iter().filter(|first| length.is_multiple_of(*first) && first * first <= length);
    let best = pairs.max_by_key(|first| (WRITTEN_OUT.contains(&(length / first)), *first))?;
    Some([best, length / best])
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

/// The smallest number, at least `least`, with no prime factor above 5: such transforms are fast.
pub(super) fn fast_length(least: usize) -> usize {
    let is_fast = |n: &usize| {
        let without = |mut n: usize, p: usize| {
            while n.is_multiple_of(p) {
                n /= p;
            }
            n
        };
        without(without(without(*n, 2), 3), 5) == 1
    };
    // The next power of two is such a number.
    let least = least.max(1);
    (least..=least.next_power_of_two()).find(is_fast).unwrap_or(least)
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
    fn a_transform_of_any_length_agrees_with_the_definition() {
        for length in (1..=150).chain([243, 512, 625]) {
            for direction in [FftDirection::Forward, FftDirection::Inverse] {
                let original: Vec<Complex<f64>> =
                    (0..length).map(|i| Complex::new((i * 7 % 11) as f64, (i * 5 % 13) as f64)).collect();
                let (mut found, mut expected) = (original.clone(), original);
                transform(length, direction).process(&mut found);
                Dft::new(length, direction).process(&mut expected);
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((found - expected).norm() < 1e-8 * length as f64, "{length} {direction}");
                }
            }
        }
    }

    #[test]
    fn lengths_up_to_that_of_the_largest_template_are_products_of_few_written_out_transforms() {
        let depth = |length: usize| {
            let (mut rest, mut depth) = (length, 1);
            while !WRITTEN_OUT.contains(&rest) {
                rest = factors(rest).map_or(0, |[_, second]| second);
                assert!(rest > 0, "{length}");
                depth += 1;
            }
            depth
        };
        assert!((6..=128).map(fast_length).all(|length| depth(length) <= 3));
        assert_eq!(
            [48, 60, 64, 100, 128].map(factors),
            [Some([6, 8]), Some([5, 12]), Some([8, 8]), Some([5, 20]), Some([8, 16])]
        );
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

    #[test]
    fn fast_lengths() {
        assert_eq!([1, 7, 11, 13, 24, 49].map(fast_length), [1, 8, 12, 15, 24, 50]);
    }
}

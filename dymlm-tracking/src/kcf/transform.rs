use std::sync::Arc;

use rustfft::algorithm::butterflies::{
    Butterfly2, Butterfly3, Butterfly4, Butterfly5, Butterfly6, Butterfly8, Butterfly9, Butterfly12,
    Butterfly16, Butterfly24, Butterfly27, Butterfly32,
};
use rustfft::algorithm::{Dft, MixedRadixSmall};
use rustfft::{Fft, FftDirection, FftNum};

/// A Fourier transform of one length, fast where that is a [`fast_length`].
///
/// `rustfft`'s planner does the same for every length, but the transforms that it might choose are then all
/// compiled: for single numbers and for lanes they were more than half of this crate's code.
pub(super) fn transform<T: FftNum>(length: usize, direction: FftDirection) -> Arc<dyn Fft<T>> {
    if let Some(written_out) = written_out(length, direction) {
        return written_out;
    }
    match factors(length) {
        Some(factors) => {
            let [rows, columns] = factors.map(|factor| transform(factor, direction));
            Arc::new(MixedRadixSmall::new(rows, columns))
        }
        None => Arc::new(Dft::new(length, direction)),
    }
}

/// Names the lengths of transforms that `rustfft` has written out.
macro_rules! written_out {
    ($($length:literal $transform:ident),*) => {
        const WRITTEN_OUT: &[usize] = &[$($length),*];

        fn written_out<T: FftNum>(length: usize, direction: FftDirection) -> Option<Arc<dyn Fft<T>>> {
            match length {
                $($length => Some(Arc::new($transform::new(direction))),)*
                _ => None,
            }
        }
    };
}

// All that have no prime factor above 5.
written_out!(
    2 Butterfly2, 3 Butterfly3, 4 Butterfly4, 5 Butterfly5, 6 Butterfly6, 8 Butterfly8, 9 Butterfly9,
    12 Butterfly12, 16 Butterfly16, 24 Butterfly24, 27 Butterfly27, 32 Butterfly32
);

/// Two factors of a length, the first of them written out: if possible both, and then as alike as they can
/// be.
fn factors(length: usize) -> Option<[usize; 2]> {
    let is_first = |first: &usize| length.is_multiple_of(*first) && first * first <= length;
    let pairs = WRITTEN_OUT.iter().copied().filter(is_first).map(|first| [first, length / first]);
    pairs.max_by_key(|[first, second]| (WRITTEN_OUT.contains(second), *first))
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
    use rustfft::num_complex::Complex;

    use super::*;

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
    fn fast_lengths() {
        assert_eq!([1, 7, 11, 13, 24, 49].map(fast_length), [1, 8, 12, 15, 24, 50]);
    }
}

use rustfft::num_complex::Complex;
use rustfft::num_traits::Zero;

use super::fourier::Fourier;
use super::lanes::Lanes;

/// Gaussian kernel correlation of packed spectra (Henriques 2015, eq. 31).
///
/// Channels are packed in pairs, z = a + i b, four pairs in the lanes of a plane, and the transform is
/// linear. Therefore the real part of the inverse transform of conj(X) Z, summed over planes, is the sum of
/// the channels' circular correlations: products of a with b are purely imaginary. Nothing needs to be
/// unpacked. O(planes x values) and two transforms.
#[derive(Debug, Clone)]
pub(super) struct KernelCorrelation {
    /// Number of values per plane.
    count: usize,
    /// 1 / (values x channels x sigma^2).
    exponent: f32,
    /// Sums of products per lane.
    sums: Vec<Complex<Lanes>>,
}

impl KernelCorrelation {
    pub(super) fn new(count: usize, channels: usize, sigma: f32) -> Self {
        let exponent = 1.0 / (count as f32 * channels as f32 * sigma * sigma);
        Self { count, exponent, sums: vec![Complex::zero(); count] }
    }

    /// Computes the spectrum of k(x, z) for all shifts of z against x, into `kernel`.
    pub(super) fn correlate(
        &mut self,
        x: &[Complex<Lanes>],
        z: &[Complex<Lanes>],
        fourier: &mut Fourier<f32>,
        kernel: &mut [Complex<f32>],
    ) {
        self.sums.fill(Complex::zero());
        for (x, z) in x.chunks_exact(self.count).zip(z.chunks_exact(self.count)) {
            for ((sum, x), z) in self.sums.iter_mut().zip(x).zip(z) {
                *sum = *sum + x.conj() * z;
            }
        }
        for (value, sum) in kernel.iter_mut().zip(&self.sums) {
            *value = Complex::new(sum.re.total(), sum.im.total());
        }
        fourier.inverse(kernel);
        // By Parseval, sums of squares in space are those of the spectrum divided by the number of values;
        // the unnormalized inverse transform needs the same division.
        let energies = energy(x) + energy(z);
        let scale = 1.0 / self.count as f32;
        for value in kernel.iter_mut() {
            let distance = (energies - 2.0 * value.re) * scale;
            *value = Complex::new((-distance.max(0.0) * self.exponent).exp(), 0.0);
        }
        fourier.forward(kernel);
    }
}

/// Sum of squares.
fn energy(values: &[Complex<Lanes>]) -> f32 {
    // Two sums, since each addition waits for the one before.
    let mut sums = [Lanes::zero(); 2];
    for pair in values.chunks(2) {
        for (sum, value) in sums.iter_mut().zip(pair) {
            *sum = *sum + value.norm_sqr();
        }
    }
    (sums[0] + sums[1]).total()
}

#[cfg(test)]
mod tests {
    use wide::f32x4;

    use super::*;
    use crate::kcf::lanes::LANES;

    #[test]
    fn agrees_with_the_kernel_of_every_shift() {
        let (w, h, planes) = (6, 4, 8);
        let pattern = |seed: usize| -> Vec<Complex<f32>> {
            let value = |i: usize| (i * seed % 23) as f32 / 23.0;
            (0..planes * w * h).map(|i| Complex::new(value(i + 1), value(i + 50))).collect()
        };
        let (x, z) = (pattern(7), pattern(13));
        // Plane 4 k + lane is the lane of packed plane k.
        let spectra = |planes: &[Complex<f32>]| {
            let lanes = |part: fn(Complex<f32>) -> f32, i: usize| {
                let first = i / (w * h) * LANES * w * h + i % (w * h);
                Lanes(f32x4::new(std::array::from_fn(|lane| part(planes[first + lane * w * h]))))
            };
            let mut packed: Vec<Complex<Lanes>> = (0..planes.len() / LANES)
                .map(|i| Complex::new(lanes(|z| z.re, i), lanes(|z| z.im, i)))
                .collect();
            Fourier::new([w, h]).forward(&mut packed);
            packed
        };

        let mut fourier = Fourier::new([w, h]);
        let mut kernel = vec![Complex::zero(); w * h];
        let (xf, zf) = (spectra(&x), spectra(&z));
        KernelCorrelation::new(w * h, 16, 0.5).correlate(&xf, &zf, &mut fourier, &mut kernel);
        fourier.inverse(&mut kernel);

        for dy in 0..h {
            for dx in 0..w {
                let mut distance = 0.0;
                for plane in 0..planes {
                    for i in 0..w * h {
                        let moved = (i / w + dy) % h * w + (i % w + dx) % w;
                        let difference = x[plane * w * h + i] - z[plane * w * h + moved];
                        distance += difference.norm_sqr();
                    }
                }
                let expected = (-distance / (24.0 * 16.0 * 0.25)).exp();
                let found = kernel[dy * w + dx] / 24.0;
                assert!((found.re - expected).abs() < 1e-4 && found.im.abs() < 1e-4, "{found} {expected}");
            }
        }
    }
}

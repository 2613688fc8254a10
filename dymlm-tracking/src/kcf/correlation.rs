use rustfft::num_complex::Complex;

use super::fourier::Fourier;

/// Gaussian kernel correlation of packed spectra (Henriques 2015, eq. 31).
///
/// Channels are packed in pairs, z = a + i b, and the transform is linear. Therefore the real part of the
/// inverse transform of conj(X) Z, summed over planes, is the sum of the channels' circular correlations:
/// products of a with b are purely imaginary. Nothing needs to be unpacked. O(planes x values) and two
/// transforms.
#[derive(Debug, Clone)]
pub(super) struct KernelCorrelation {
    /// Number of values per plane.
    count: usize,
    /// 1 / (values x channels x sigma^2).
    exponent: f32,
}

impl KernelCorrelation {
    pub(super) fn new(count: usize, channels: usize, sigma: f32) -> Self {
        Self { count, exponent: 1.0 / (count as f32 * channels as f32 * sigma * sigma) }
    }

    /// Computes the spectrum of k(x, z) for all shifts of z against x, into `kernel`.
    pub(super) fn correlate(
        &self,
        x: &[Complex<f32>],
        z: &[Complex<f32>],
        fourier: &mut Fourier,
        kernel: &mut [Complex<f32>],
    ) {
        kernel.fill(Complex::default());
        for (x, z) in x.chunks_exact(self.count).zip(z.chunks_exact(self.count)) {
            for ((sum, x), z) in kernel.iter_mut().zip(x).zip(z) {
                *sum += x.conj() * z;
            }
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

/// Sum of squares, in eight lanes so that vector code adds in the same order.
fn energy(values: &[Complex<f32>]) -> f32 {
    let mut lanes = [0.0_f32; 8];
    for chunk in values.chunks(8) {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value.norm_sqr();
        }
    }
    lanes.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_kernel_of_every_shift() {
        let (w, h, planes) = (6, 4, 2);
        let pattern = |seed: usize| -> Vec<Complex<f32>> {
            let value = |i: usize| (i * seed % 23) as f32 / 23.0;
            (0..planes * w * h).map(|i| Complex::new(value(i + 1), value(i + 50))).collect()
        };
        let (x, z) = (pattern(7), pattern(13));

        let mut fourier = Fourier::new([w, h]);
        let (mut xf, mut zf) = (x.clone(), z.clone());
        fourier.forward(&mut xf);
        fourier.forward(&mut zf);
        let mut kernel = vec![Complex::default(); w * h];
        KernelCorrelation::new(w * h, 4, 0.5).correlate(&xf, &zf, &mut fourier, &mut kernel);
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
                let expected = (-distance / (24.0 * 4.0 * 0.25)).exp();
                let found = kernel[dy * w + dx] / 24.0;
                assert!((found.re - expected).abs() < 1e-4 && found.im.abs() < 1e-4, "{found} {expected}");
            }
        }
    }
}

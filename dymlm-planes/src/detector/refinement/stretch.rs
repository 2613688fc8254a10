use dymlm_core::DepthNoise;
use wide::{f32x4, f64x2};

use super::super::wide_noise::sigmas;
use super::reweighting::{Trial, WeightedSums};
use crate::moments::{Moments, RowSums};

/// Readings that are weighted and summed as one group; their counts are exact in single precision.
pub(super) const STRETCH: usize = 64;
/// Readings that are weighted at once.
pub(super) const LANES: usize = 4;

/// The weighting of the readings of one row, with all that they share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighing<K> {
    noise: DepthNoise,
    /// The distance of a reading z at the ray height of the row is z (`nx` a + `of_row`) + `d`.
    nx: f32x4,
    of_row: f32x4,
    d: f32x4,
    per_reach: f32x4,
    /// The weight as a function of 1 - (r / reach)^2.
    kernel: K,
}

impl<K: Fn(f32x4) -> f32x4> Weighing<K> {
    pub(super) fn new(trial: &Trial, b: f64, kernel: K) -> Self {
        let [nx, ny, nz] = trial.normal;
        Self {
            noise: trial.sensor.noise,
            nx: f32x4::splat(nx),
            of_row: f32x4::splat(ny * b as f32 + nz),
            d: f32x4::splat(trial.d),
            per_reach: f32x4::splat(1.0 / trial.reach),
            kernel,
        }
    }

    /// The weights of four readings at the rays `a`; what else is summed of them is added to the sums.
    #[inline]
    pub(super) fn weigh(&self, z: f32x4, a: f32x4, sums: &mut StretchSums) -> f32x4 {
        let per_noise = f32x4::ONE / sigmas(&self.noise, z);
        let distance = (z * (self.nx * a + self.of_row) + self.d) * per_noise;
        let part = distance * self.per_reach;
        let inside = f32x4::ONE - part * part;
        let kernel = (self.kernel)(inside) & inside.simd_ge(f32x4::ZERO) & z.simd_gt(f32x4::ZERO);
        let precision = f32x4::splat(self.noise.floor) * per_noise;
        sums.readings += f32x4::ONE & kernel.simd_gt(f32x4::ZERO);
        sums.kernel_weight += kernel;
        let (square, weight) = (distance * distance, kernel * precision * precision);
        sums.squares += kernel * square;
        sums.weighted_squares += weight * square;
        weight
    }
}

/// The sums over a stretch of a row, in lanes. They lack the row's ray height, which is multiplied in once.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StretchSums {
    readings: f32x4,
    kernel_weight: f32x4,
    squares: f32x4,
    weighted_squares: f32x4,
    w: f64x2,
    wz: f64x2,
    waz: f64x2,
    wzz: f64x2,
    wazz: f64x2,
    waazz: f64x2,
}

impl StretchSums {
    /// Adds two readings at the rays `a`.
    #[inline]
    pub(super) fn add(&mut self, weights: [f32; 2], z: [f32; 2], a: [f64; 2]) {
        let [weight, z] = [weights, z].map(|pair| f64x2::from(pair.map(f64::from)));
        let a = f64x2::from(a);
        let of_first = weight * z;
        let of_second = of_first * z;
        let along = of_second * a;
        self.w += weight;
        self.wz += of_first;
        self.waz += of_first * a;
        self.wzz += of_second;
        self.wazz += along;
        self.waazz += along * a;
    }

    /// Adds the sums to those of a plane; `b` is the row's ray height.
    #[inline]
    pub(super) fn add_to(&self, b: f64, sums: &mut WeightedSums) {
        let [weight, z, az, zz, azz, aazz] = [self.w, self.wz, self.waz, self.wzz, self.wazz, self.waazz]
            .map(|lanes| {
                let [even, odd] = lanes.to_array();
                even + odd
            });
        sums.moments.add(&Moments::of_row(b, RowSums { weight, z, az, zz, azz, aazz }));
        let [readings, kernel_weight, squares, weighted_squares] =
            [self.readings, self.kernel_weight, self.squares, self.weighted_squares]
                .map(|lanes| lanes.to_array().iter().sum::<f32>());
        sums.readings += readings as usize;
        sums.kernel_weight += f64::from(kernel_weight);
        sums.squares += f64::from(squares);
        sums.weighted_squares += f64::from(weighted_squares);
    }
}

use dymlm_core::SensorModel;
use dymlm_core::vector3::dot;

use crate::moments::{Fit, Moments, RowSums};

/// A plane, and the weighting of readings near it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    normal: [f32; 3],
    d: f32,
    sensor: SensorModel,
    /// Distance at which weights become 0, in units of the sensor's noise.
    reach: f32,
    kernel: Kernel,
}

/// The weight as a function of the distance r, up to the reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kernel {
    /// (1 - (r / reach)^2)^2.
    Tukey,
    /// Constant 1.
    Inlier,
}

/// Sums over the inliers of one plane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WeightedSums {
    pub(super) moments: Moments,
    /// Number of readings with a weight above 0.
    pub(super) readings: usize,
    /// Sum of kernel weights (without 1 / sigma^2) times squared distance over the sensor's squared noise,
    /// and sum of kernel weights.
    pub(super) squares: f64,
    pub(super) kernel_weight: f64,
}

impl Trial {
    pub(super) fn new(fit: &Fit, reach: f64, kernel: Kernel, sensor: SensorModel) -> Self {
        Self {
            normal: fit.normal.map(|n| n as f32),
            d: -dot(fit.normal, fit.centroid) as f32,
            sensor,
            reach: reach as f32,
            kernel,
        }
    }

    /// Distance of the reading z on the ray (a, b, 1) from the plane, metres, with sign.
    #[inline]
    fn distance(&self, z: f32, a: f32, b: f32) -> f32 {
        let [nx, ny, nz] = self.normal;
        z * (nx * a + (ny * b + nz)) + self.d
    }

    #[inline]
    pub(super) fn is_inlier(&self, z: f32, a: f32, b: f32) -> bool {
        z > 0.0 && (self.distance(z, a, b) / self.sensor.sigma(z)).abs() <= self.reach
    }

    /// Adds the readings of adjacent pixels of a row; `b` is the row's ray height, `ray_x` are the rays of
    /// the columns.
    pub(super) fn add_run(&self, depths: &[f32], ray_x: &[f64], b: f64, sums: &mut WeightedSums) {
        let mut weights = [0.0; STRETCH];
        for (depths, ray_x) in depths.chunks(STRETCH).zip(ray_x.chunks(STRETCH)) {
            let weights = &mut weights[..depths.len()];
            self.weigh(depths, ray_x, b as f32, weights, sums);
            sums.moments.add(&sum_row(weights, depths, ray_x, b));
        }
    }

    /// Computes the weight of each reading, and adds to all sums except the moments.
    fn weigh(&self, depths: &[f32], ray_x: &[f64], b: f32, weights: &mut [f32], sums: &mut WeightedSums) {
        let per_reach = 1.0 / self.reach;
        let (mut readings, mut kernel_weight, mut squares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut weigh = |lane: usize, z: f32, a: f64, weight: &mut f32| {
            let per_noise = 1.0 / self.sensor.sigma(z);
            let distance = self.distance(z, a as f32, b) * per_noise;
            let part = distance * per_reach;
            let inside = 1.0 - part * part;
            let kernel = match self.kernel {
                Kernel::Tukey => inside * inside,
                Kernel::Inlier => 1.0,
            };
            let kernel = if inside >= 0.0 && z > 0.0 { kernel } else { 0.0 };
            let precision = self.sensor.noise.floor * per_noise;
            readings[lane] += if kernel > 0.0 { 1.0 } else { 0.0 };
            kernel_weight[lane] += kernel;
            squares[lane] += kernel * distance * distance;
            *weight = kernel * precision * precision;
        };
        let ((depths, last_depths), (rays, last_rays)) =
            (depths.as_chunks::<LANES>(), ray_x.as_chunks::<LANES>());
        let (weights, last_weights) = weights.as_chunks_mut::<LANES>();
        for ((z, a), weight) in depths.iter().zip(rays).zip(weights) {
            for k in 0..LANES {
                weigh(k, z[k], a[k], &mut weight[k]);
            }
        }
        for ((&z, &a), weight) in last_depths.iter().zip(last_rays).zip(last_weights) {
            weigh(0, z, a, weight);
        }
        sums.readings += readings.iter().sum::<f32>() as usize;
        sums.kernel_weight += f64::from(kernel_weight.iter().sum::<f32>());
        sums.squares += f64::from(squares.iter().sum::<f32>());
    }
}

/// Readings that are weighted and then summed as one group, so that their weights stay in the cache.
const STRETCH: usize = 64;
/// Readings that are weighted at once.
const LANES: usize = 4;

/// Sums over readings of one row at rays `ray_x`; the row's ray height `b` is multiplied in once.
fn sum_row(weights: &[f32], depths: &[f32], ray_x: &[f64], b: f64) -> Moments {
    let [mut w, mut wz, mut waz, mut wzz, mut wazz, mut waazz] = [[0.0; 2]; 6];
    let mut add = |lane: usize, weight: f32, z: f32, a: f64| {
        let (weight, z) = (f64::from(weight), f64::from(z));
        let of_first = weight * z;
        let of_second = of_first * z;
        w[lane] += weight;
        wz[lane] += of_first;
        waz[lane] += of_first * a;
        wzz[lane] += of_second;
        wazz[lane] += of_second * a;
        waazz[lane] += of_second * a * a;
    };
    let ((pairs, last), (depths, last_depth), (rays, last_ray)) =
        (weights.as_chunks::<2>(), depths.as_chunks::<2>(), ray_x.as_chunks::<2>());
    for ((weight, z), a) in pairs.iter().zip(depths).zip(rays) {
        for k in 0..2 {
            add(k, weight[k], z[k], a[k]);
        }
    }
    for ((&weight, &z), &a) in last.iter().zip(last_depth).zip(last_ray) {
        add(0, weight, z, a);
    }
    let [w, wz, waz, wzz, wazz, waazz] = [w, wz, waz, wzz, wazz, waazz].map(|[a, b]| a + b);
    Moments::of_row(b, RowSums { weight: w, z: wz, az: waz, zz: wzz, azz: wazz, aazz: waazz })
}

use dymlm_core::SensorModel;
use dymlm_core::vector3::dot;
use wide::f32x4;

use super::stretch::{LANES, STRETCH, StretchSums, Weighing};
use crate::moments::{Fit, Moments};

/// A plane, and the weighting of readings near it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub(super) normal: [f32; 3],
    pub(super) d: f32,
    pub(super) sensor: SensorModel,
    /// Distance at which weights become 0, in units of the sensor's noise.
    pub(super) reach: f32,
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
    /// The same sum of squares, with the weights of the moments.
    pub(super) weighted_squares: f64,
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

    /// Adds the readings of adjacent pixels of a row; `b` is the row's ray height, `rays` are the rays of the
    /// columns in double and single precision.
    pub(super) fn add_run(&self, depths: &[f32], rays: (&[f64], &[f32]), b: f64, sums: &mut WeightedSums) {
        match self.kernel {
            Kernel::Tukey => self.add_stretches(|inside| inside * inside, depths, rays, b, sums),
            Kernel::Inlier => self.add_stretches(|_| f32x4::ONE, depths, rays, b, sums),
        }
    }

    /// Adds a run in stretches, each with sums of its own; `kernel` gives the weight by 1 - (r / reach)^2.
    #[inline]
    fn add_stretches(
        &self,
        kernel: impl Fn(f32x4) -> f32x4 + Copy,
        depths: &[f32],
        (ray_x, ray_x_single): (&[f64], &[f32]),
        b: f64,
        sums: &mut WeightedSums,
    ) {
        let weighing = Weighing::new(self, b, kernel);
        let rays = ray_x.chunks(STRETCH).zip(ray_x_single.chunks(STRETCH));
        for (depths, (ray_x, ray_x_single)) in depths.chunks(STRETCH).zip(rays) {
            let mut stretch = StretchSums::default();
            let ((depths, last_depths), (ray_x, last_ray_x), (single, last_single)) =
                (depths.as_chunks::<LANES>(), ray_x.as_chunks::<LANES>(), ray_x_single.as_chunks::<LANES>());
            for ((z, a), single) in depths.iter().zip(ray_x).zip(single) {
                let weights = weighing.weigh(f32x4::from(*z), f32x4::from(*single), &mut stretch);
                let [w0, w1, w2, w3] = weights.to_array();
                stretch.add([w0, w1], [z[0], z[1]], [a[0], a[1]]);
                stretch.add([w2, w3], [z[2], z[3]], [a[2], a[3]]);
            }
            let last = last_depths.iter().zip(last_ray_x).zip(last_single);
            for (k, ((&z, &a), &single)) in last.enumerate() {
                let weights = weighing.weigh(alone(z), alone(single), &mut stretch);
                let [weight, ..] = weights.to_array();
                // The lane of the other reading of the pair stays as it is.
                let at = |x: f32| if k % 2 == 0 { [x, 0.0] } else { [0.0, x] };
                stretch.add(at(weight), at(z), [a; 2]);
            }
            stretch.add_to(b, sums);
        }
    }
}

/// A reading, or its ray, without neighbours.
fn alone(x: f32) -> f32x4 {
    f32x4::from([x, 0.0, 0.0, 0.0])
}

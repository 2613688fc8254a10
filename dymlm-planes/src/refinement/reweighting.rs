use dymlm_core::axial_noise;

use crate::linear_algebra::dot;
use crate::moments::{Fit, Moments};

/// A plane, and how readings near it weigh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    normal: [f32; 3],
    d: f32,
    /// Distances at which weights end, in units of the axial noise.
    reach: f32,
    kernel: Kernel,
}

/// How the weight falls with the distance, up to the reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kernel {
    /// (1 - (r / reach)^2)^2.
    Tukey,
    /// 1.
    Inlier,
}

/// Sums over the inliers of one plane.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WeightedSums {
    pub(super) moments: Moments,
    /// Number of readings with a weight.
    pub(super) readings: usize,
    /// Sum of weights times squared distance over squared axial noise; the weights without 1 / sigma^2.
    pub(super) squares: f64,
    pub(super) kernel_weight: f64,
}

/// Axial noise at 0.4 m and nearer: the unit of weights.
pub(crate) fn finest_noise() -> f64 {
    f64::from(axial_noise(0.4))
}

impl Trial {
    pub(super) fn new(fit: &Fit, reach: f64, kernel: Kernel) -> Self {
        Self {
            normal: fit.normal.map(|n| n as f32),
            d: -dot(fit.normal, fit.centroid) as f32,
            reach: reach as f32,
            kernel,
        }
    }

    /// Distance from the plane in units of the axial noise, for the reading z on the ray (a, b, 1).
    #[inline]
    pub(super) fn normalized_distance(&self, z: f32, a: f32, b: f32) -> f32 {
        let [nx, ny, nz] = self.normal;
        (z * (nx * a + (ny * b + nz)) + self.d) / axial_noise(z)
    }

    #[inline]
    pub(super) fn is_inlier(&self, z: f32, a: f32, b: f32) -> bool {
        z > 0.0 && self.normalized_distance(z, a, b).abs() <= self.reach
    }

    /// Adds the readings of one run of pixels of a row at ray height `b`; `ray_x` are those of its columns.
    pub(super) fn add_run(&self, depths: &[f32], ray_x: &[f64], b: f64, sums: &mut WeightedSums) {
        let mut lanes = [Lane::default(); 4];
        let (pixels, rays) = (depths.chunks_exact(4), ray_x.chunks_exact(4));
        let (last_pixels, last_rays) = (pixels.remainder(), rays.remainder());
        for (pixels, rays) in pixels.zip(rays) {
            for k in 0..4 {
                lanes[k].add(self, pixels[k], rays[k], b as f32);
            }
        }
        for ((lane, &z), &a) in lanes.iter_mut().zip(last_pixels).zip(last_rays) {
            lane.add(self, z, a, b as f32);
        }
        for lane in &lanes {
            lane.flush(b, sums);
        }
    }
}

/// Sums over readings z at rays a of one row; its b enters at the end of the row.
#[derive(Debug, Clone, Copy, Default)]
struct Lane {
    readings: f32,
    kernel_weight: f32,
    squares: f32,
    w: f64,
    wz: f64,
    waz: f64,
    wzz: f64,
    wazz: f64,
    waazz: f64,
}

impl Lane {
    #[inline]
    fn add(&mut self, trial: &Trial, z: f32, a: f64, b: f32) {
        let noise = axial_noise(z);
        let distance = trial.normalized_distance(z, a as f32, b);
        let part = distance / trial.reach;
        let inside = 1.0 - part * part;
        let kernel = match trial.kernel {
            Kernel::Tukey => inside * inside,
            Kernel::Inlier => 1.0,
        };
        let kernel = if inside >= 0.0 && z > 0.0 { kernel } else { 0.0 };
        let precision = axial_noise(0.4) / noise;
        let w = f64::from(kernel * precision * precision);
        let z = f64::from(z);
        let wz = w * z;
        let wzz = wz * z;
        let wazz = wzz * a;
        self.readings += if kernel > 0.0 { 1.0 } else { 0.0 };
        self.kernel_weight += kernel;
        self.squares += kernel * distance * distance;
        self.w += w;
        self.wz += wz;
        self.waz += wz * a;
        self.wzz += wzz;
        self.wazz += wazz;
        self.waazz += wazz * a;
    }

    fn flush(&self, b: f64, sums: &mut WeightedSums) {
        sums.readings += self.readings as usize;
        sums.kernel_weight += f64::from(self.kernel_weight);
        sums.squares += f64::from(self.squares);
        sums.moments.add(&Moments {
            weight: self.w,
            first: [self.waz, b * self.wz, self.wz],
            second: [self.waazz, b * self.wazz, self.wazz, b * b * self.wzz, b * self.wzz, self.wzz],
        });
    }
}

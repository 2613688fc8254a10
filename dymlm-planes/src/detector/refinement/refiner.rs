use dymlm_core::vector3::dot;
use dymlm_core::{DepthImage, PinholeCamera, SensorModel};

use super::super::covariance::PlaneCovariance;
use super::super::detected_plane::DetectedPlane;
use super::super::extraction::{Extraction, Segment};
use super::super::patch_range::patch_range;
use super::super::plane_samples::RayLattice;
use super::super::rays::Rays;
use super::reweighting::{Kernel, Trial, WeightedSums};
use super::runs::{Run, find_runs};
use crate::moments::Fit;

/// Readings within this many standard deviations are inliers; farther ones have no weight in the fit.
const INLIER_WIDTH: f64 = 3.0;
/// Number of neighbouring readings that share one error, because a structured-light camera matches windows of
/// the image. It scales only the covariance.
const CORRELATED_PIXELS: f64 = 9.0;
/// The share of the noise's variance that is left within the inliers' limit. The noise by which that is set
/// is measured with Tukey's weights, which see 0.80 of it, so it lies at t = 2.39 deviations; of a Gaussian
/// that leaves 1 - 2 t phi(t) / (2 Phi(t) - 1). It scales only the covariance.
const KEPT_VARIANCE: f64 = 0.889;
/// Spacing of the samples of a patch, pixels of a Kinect: 3 cm at 4 m.
const SAMPLE_STRIDE: f64 = 4.0;
/// Every second row is read while reweighting, because neighbouring readings share their errors; the last fit
/// reads all rows.
const ROWS_WHILE_REWEIGHTING: u32 = 2;

/// Fits extracted planes again robustly, with inliers, samples of the patch and covariance.
///
/// Iteratively reweighted least squares with Tukey's biweight (Holland, Welsch 1977) on distances in units of
/// the sensor's axial noise, each reading weighted by 1 / sigma(z)^2 as in the cloud map. The paper's second
/// fit uses PCL's RANSAC; reweighting needs no random numbers, starts from the extraction's good fit, and
/// ends with a fit to all inliers. The scale of the noise is measured for each plane, so sensors that differ
/// from the model work too.
///
/// O(pixels) per iteration. The refiner owns its buffers.
#[derive(Debug, Clone)]
pub(in crate::detector) struct PlaneRefiner {
    sensor: SensorModel,
    /// 1 / (fx fy).
    pixel_solid_angle: f64,
    /// Spacing of the samples of patches along rows and columns, pixels.
    stride: usize,
    runs: Vec<Run>,
    fits: Vec<Fit>,
    /// Noise of each plane, as a multiple of the model's.
    noise_ratios: Vec<f64>,
    trials: Vec<Trial>,
    sums: Vec<WeightedSums>,
    /// Index in `planes` of each segment's plane, if it has one.
    places: Vec<Option<usize>>,
    planes: Vec<DetectedPlane>,
}

impl PlaneRefiner {
    /// A refiner with empty buffers.
    pub(in crate::detector) fn new(sensor: SensorModel) -> Self {
        Self {
            sensor,
            pixel_solid_angle: 0.0,
            stride: 1,
            runs: Vec::new(),
            fits: Vec::new(),
            noise_ratios: Vec::new(),
            trials: Vec::new(),
            sums: Vec::new(),
            places: Vec::new(),
            planes: Vec::new(),
        }
    }

    /// Refines the planes of an extraction of the same image. A segment whose inliers do not define a plane
    /// is left out.
    pub(in crate::detector) fn refine(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        rays: &Rays,
        extraction: &Extraction,
    ) {
        self.begin(camera, extraction);
        self.sum_up(depth, rays, Kernel::Tukey, INLIER_WIDTH, ROWS_WHILE_REWEIGHTING);
        self.refit();
        self.sum_up(depth, rays, Kernel::Inlier, INLIER_WIDTH, 1);
        self.refit();
        self.collect_planes(extraction.segments(), camera);
        self.sample_patches(depth, rays, extraction);
    }

    /// The last result.
    pub(in crate::detector) fn planes(&self) -> &[DetectedPlane] {
        &self.planes
    }

    /// The last result, from which the filter removes planes.
    pub(in crate::detector) fn planes_mut(&mut self) -> &mut Vec<DetectedPlane> {
        &mut self.planes
    }

    fn begin(&mut self, camera: &PinholeCamera, extraction: &Extraction) {
        self.pixel_solid_angle = (1.0 / (camera.fx() * camera.fy())).abs();
        let stride = (SAMPLE_STRIDE * camera.focal_scale()).round().max(1.0) as usize;
        self.stride = RayLattice::bounded_stride(camera, stride);
        find_runs(extraction.labels(), extraction.width(), &mut self.runs);
        self.fits.clear();
        self.fits.extend(extraction.segments().iter().map(|segment| segment.fit));
        self.noise_ratios.clear();
        self.noise_ratios.extend(self.fits.iter().map(|fit| {
            let noise = f64::from(self.sensor.sigma(fit.centroid[2] as f32));
            (fit.mse.sqrt() / noise).max(f64::EPSILON)
        }));
    }

    /// Sums up the readings of every `rows`-th row, weighted by their distances from the planes' present
    /// fits.
    fn sum_up(&mut self, depth: &DepthImage, rays: &Rays, kernel: Kernel, width: f64, rows: u32) {
        self.trials.clear();
        self.trials.extend(
            self.fits
                .iter()
                .zip(&self.noise_ratios)
                .map(|(fit, ratio)| Trial::new(fit, width * ratio, kernel, self.sensor)),
        );
        self.sums.clear();
        self.sums.resize(self.fits.len(), WeightedSums::default());
        for run in self.runs.iter().filter(|run| run.v % rows == 0) {
            let index = usize::from(run.label) - 1;
            let (Some(trial), Some(sums)) = (self.trials.get(index), self.sums.get_mut(index)) else {
                continue;
            };
            let (v, columns) = (run.v as usize, run.first as usize..run.end as usize);
            let row = &depth.data()[v * depth.width()..(v + 1) * depth.width()];
            let ray_x = (&rays.x[columns.clone()], &rays.x_single[columns.clone()]);
            trial.add_run(&row[columns], ray_x, rays.y[v], sums);
        }
    }

    fn refit(&mut self) {
        for ((fit, ratio), sums) in self.fits.iter_mut().zip(&mut self.noise_ratios).zip(&self.sums) {
            if let Some(better) = sums.moments.fit() {
                *fit = better;
                *ratio = (sums.squares / sums.kernel_weight).sqrt().max(f64::EPSILON);
            }
        }
    }

    /// Collects the refined planes; the buffers of the last frame's planes are reused.
    fn collect_planes(&mut self, segments: &[Segment], camera: &PinholeCamera) {
        let mut buffers: Vec<_> = self.planes.drain(..).map(|plane| plane.samples).collect();
        self.places.clear();
        for (index, segment) in segments.iter().enumerate() {
            let (fit, sums) = (&self.fits[index], &self.sums[index]);
            // The variance of a mean with weights 1 / sigma^2 is the sum of these times the squares of the
            // readings' distances over sigma, over the square of their sum: near readings weigh more, in what
            // they err, too.
            let finest_noise = f64::from(self.sensor.noise.floor);
            let square = sums.weighted_squares / sums.moments.weight.max(f64::MIN_POSITIVE);
            let inflation = CORRELATED_PIXELS / KEPT_VARIANCE * finest_noise * finest_noise * square;
            let covariance = PlaneCovariance::new(&sums.moments, fit.normal, inflation);
            let (Some(plane), Some(covariance)) = (fit.plane(), covariance) else {
                self.places.push(None);
                continue;
            };
            let mut samples = buffers.pop().unwrap_or_default();
            samples.begin(RayLattice::of_pixels(camera, self.stride));
            self.places.push(Some(self.planes.len()));
            self.planes.push(DetectedPlane {
                plane,
                centroid: fit.centroid,
                covariance,
                mse: fit.mse,
                support: segment.support,
                inliers: sums.readings,
                area: 0.0,
                samples,
                label: index as u16 + 1,
                moments: sums.moments,
            });
        }
    }

    fn sample_patches(&mut self, depth: &DepthImage, rays: &Rays, extraction: &Extraction) {
        let (width, stride) = (extraction.width(), self.stride);
        let mut sample = 0;
        for v in (stride / 2..extraction.height()).step_by(stride) {
            for u in (stride / 2..width).step_by(stride) {
                if let Some((place, z)) = self.inlier_at(depth, rays, extraction, u, v) {
                    let plane = &mut self.planes[place];
                    plane.samples.places.push(sample);
                    // The area of the plane that one pixel covers, times the number of pixels per sample.
                    let slant = (plane.plane.d() / z).max(1e-3);
                    plane.area += self.pixel_solid_angle * z * z / slant * (stride * stride) as f64;
                }
                sample += 1;
            }
        }
    }

    /// The plane of which a pixel is an inlier, and the depth of the plane at that pixel, metres.
    fn inlier_at(
        &self,
        depth: &DepthImage,
        rays: &Rays,
        extraction: &Extraction,
        u: usize,
        v: usize,
    ) -> Option<(usize, f64)> {
        let index = extraction.segment_at(u, v)?;
        let place = (*self.places.get(index)?)?;
        let (a, b, z) = (rays.x[u], rays.y[v], depth.at(u, v));
        if z > patch_range(&self.sensor) || !self.trials[index].is_inlier(z, a as f32, b as f32) {
            return None;
        }
        // The point where the ray meets the plane is used, so that noise does not blur the patch. If that is
        // far from the reading, the reading belongs to the wall at which the plane ends.
        let (fit, reading) = (&self.fits[index], z);
        let z = dot(fit.normal, fit.centroid) / dot(fit.normal, [a, b, 1.0]);
        let is_there = (z - f64::from(reading)).abs() <= self.sensor.tolerance(reading, 0.0);
        let is_in_range = is_there && (0.0..=self.sensor.max_depth.into()).contains(&z);
        is_in_range.then_some((place, z))
    }
}

use dymlm_core::vector3::dot;
use dymlm_core::{DepthImage, PinholeCamera, Point};

use super::edge_points::{fill_around, visit_rims};
use super::reweighting::{Kernel, Trial, WeightedSums, finest_noise};
use super::runs::{Run, find_runs};
use super::{DetectedPlane, PlaneCovariance, RefinementConfig};
use crate::PlaneError;
use crate::extraction::{Extraction, Segment};
use crate::moments::Fit;

/// While reweighting every second row is read: neighbouring readings share their errors, and the last fit reads all.
const ROWS_WHILE_REWEIGHTING: u32 = 2;
/// No plane is taken to be less noisy than this share of the sensor's model.
const SMALLEST_NOISE_RATIO: f64 = 0.05;

/// Fits extracted planes again, robustly: inliers, edge points, covariance.
///
/// Iteratively reweighted least squares with Tukey's biweight (Holland, Welsch 1977) on distances in units of the
/// sensor's axial noise, each reading weighted by 1 / sigma(z)^2 as in the cloud map. The paper's second fit uses PCL's
/// RANSAC; reweighting needs no random numbers, starts from the extraction's good fit, and ends on all inliers. The noise's
/// scale is measured for each plane, so other sensors than the model's are served too.
///
/// O(pixels) a round. The refiner owns its buffers.
///
/// ```
/// use dymlm_core::{DepthImage, PinholeCamera};
/// use dymlm_planes::{ExtractionConfig, PlaneExtractor, PlaneRefiner, RefinementConfig};
///
/// // A wall at 2 m with a thing of 3 cm before a small part of it.
/// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
/// let depth = |i: usize| if i % 160 < 6 && i / 160 < 6 { 1.97 } else { 2.0 };
/// let depth = DepthImage::new(160, 120, (0..160 * 120).map(depth).collect())?;
///
/// let mut extractor = PlaneExtractor::new(ExtractionConfig::default())?;
/// let mut refiner = PlaneRefiner::new(RefinementConfig::default())?;
/// let extraction = extractor.extract(&camera, &depth, None)?;
/// let planes = refiner.refine(&camera, &depth, extraction)?;
/// assert!(planes.len() == 1 && (planes[0].plane.d() - 2.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PlaneRefiner {
    config: RefinementConfig,
    /// 1 / (fx fy).
    pixel_solid_angle: f64,
    ray_x: Vec<f64>,
    ray_y: Vec<f64>,
    runs: Vec<Run>,
    fits: Vec<Fit>,
    /// Noise of each plane, as a multiple of the model's.
    noise_ratios: Vec<f64>,
    trials: Vec<Trial>,
    sums: Vec<WeightedSums>,
    /// The plane of each segment, if any.
    places: Vec<Option<usize>>,
    planes: Vec<DetectedPlane>,
}

impl PlaneRefiner {
    /// A refiner with empty buffers.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Config`] names the field outside its range.
    pub fn new(config: RefinementConfig) -> Result<Self, PlaneError> {
        config.validate()?;
        Ok(Self {
            config,
            pixel_solid_angle: 0.0,
            ray_x: Vec::new(),
            ray_y: Vec::new(),
            runs: Vec::new(),
            fits: Vec::new(),
            noise_ratios: Vec::new(),
            trials: Vec::new(),
            sums: Vec::new(),
            places: Vec::new(),
            planes: Vec::new(),
        })
    }

    /// Refines the planes of an extraction of the same image. A segment whose inliers make no plane is left out.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Core`] when image or extraction are of another size than the camera; the last result stays.
    pub fn refine(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        extraction: &Extraction,
    ) -> Result<&[DetectedPlane], PlaneError> {
        camera.check_size("the depth image", depth.width(), depth.height())?;
        camera.check_size("the extraction", extraction.width(), extraction.height())?;
        self.begin(camera, extraction);
        for _ in 0..self.config.iterations {
            self.sum_up(depth, Kernel::Tukey, self.config.tukey_width, ROWS_WHILE_REWEIGHTING);
            self.refit();
        }
        self.sum_up(depth, Kernel::Inlier, self.config.inlier_width, 1);
        self.refit();
        self.collect_planes(extraction.segments());
        self.sample_patches(depth, extraction);
        self.find_edges(depth, extraction);
        Ok(&self.planes)
    }

    /// The last result.
    pub fn planes(&self) -> &[DetectedPlane] {
        &self.planes
    }

    /// The last result, to be thinned out.
    pub(crate) fn planes_mut(&mut self) -> &mut Vec<DetectedPlane> {
        &mut self.planes
    }

    /// The config.
    pub fn config(&self) -> &RefinementConfig {
        &self.config
    }

    fn begin(&mut self, camera: &PinholeCamera, extraction: &Extraction) {
        self.pixel_solid_angle = (1.0 / (camera.fx() * camera.fy())).abs();
        self.ray_x.clear();
        self.ray_x.extend((0..camera.width()).map(|u| (u as f64 - camera.cx()) / camera.fx()));
        self.ray_y.clear();
        self.ray_y.extend((0..camera.height()).map(|v| (v as f64 - camera.cy()) / camera.fy()));
        find_runs(extraction.labels(), extraction.width(), &mut self.runs);
        self.fits.clear();
        self.fits.extend(extraction.segments().iter().map(|segment| Fit {
            centroid: segment.centroid,
            normal: segment.plane.normal(),
            mse: segment.mse,
            depth_mse: segment.mse,
        }));
        self.noise_ratios.clear();
        self.noise_ratios.extend(self.fits.iter().map(|fit| {
            let noise = f64::from(dymlm_core::axial_noise(fit.centroid[2] as f32));
            (fit.mse.sqrt() / noise).max(SMALLEST_NOISE_RATIO)
        }));
    }

    /// Sums up the readings of every so many rows, weighed by the planes' present fits.
    fn sum_up(&mut self, depth: &DepthImage, kernel: Kernel, width: f64, rows: u32) {
        self.trials.clear();
        self.trials.extend(
            self.fits
                .iter()
                .zip(&self.noise_ratios)
                .map(|(fit, ratio)| Trial::new(fit, width * ratio, kernel)),
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
            trial.add_run(&row[columns.clone()], &self.ray_x[columns], self.ray_y[v], sums);
        }
    }

    fn refit(&mut self) {
        for ((fit, ratio), sums) in self.fits.iter_mut().zip(&mut self.noise_ratios).zip(&self.sums) {
            if let Some(better) = sums.moments.fit() {
                *fit = better;
                *ratio = (sums.squares / sums.kernel_weight).sqrt().max(SMALLEST_NOISE_RATIO);
            }
        }
    }

    /// Puts the planes together; the buffers of the last frame's planes are used again.
    fn collect_planes(&mut self, segments: &[Segment]) {
        let mut buffers: Vec<_> =
            self.planes.drain(..).map(|plane| (plane.samples, plane.edge_points)).collect();
        self.places.clear();
        for (index, segment) in segments.iter().enumerate() {
            let (fit, sums) = (&self.fits[index], &self.sums[index]);
            let inflation =
                self.config.correlated_pixels * (finest_noise() * self.noise_ratios[index]).powi(2);
            let covariance = PlaneCovariance::new(&sums.moments, fit.normal, inflation);
            let (Some(plane), Some(covariance)) = (fit.plane(), covariance) else {
                self.places.push(None);
                continue;
            };
            let (mut samples, mut edge_points) = buffers.pop().unwrap_or_default();
            samples.clear();
            edge_points.clear();
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
                edge_points,
                segment: index,
                moments: sums.moments,
            });
        }
    }

    fn sample_patches(&mut self, depth: &DepthImage, extraction: &Extraction) {
        let (width, stride) = (extraction.width(), self.stride(extraction.width()));
        for v in (stride / 2..extraction.height()).step_by(stride) {
            for u in (stride / 2..width).step_by(stride) {
                if let Some((place, point)) = self.inlier_at(depth, extraction, u, v) {
                    let plane = &mut self.planes[place];
                    plane.samples.push(point);
                    // What one pixel covers of the plane, as many times as there are pixels to a sample.
                    let z = f64::from(point[2]);
                    let slant = (plane.plane.d() / z).max(1e-3);
                    plane.area += self.pixel_solid_angle * z * z / slant * (stride * stride) as f64;
                }
            }
        }
    }

    fn find_edges(&mut self, depth: &DepthImage, extraction: &Extraction) {
        let (labels, width) = (extraction.labels(), extraction.width());
        let mut planes = std::mem::take(&mut self.planes);
        visit_rims(labels, width, &self.runs, self.stride(width), |u, v, _| {
            if let Some((place, point)) = self.inlier_at(depth, extraction, u, v)
                && fill_around(labels, width, u, v) >= self.config.min_edge_fill
            {
                planes[place].edge_points.push(point);
            }
        });
        self.planes = planes;
    }

    fn stride(&self, width: usize) -> usize {
        ((self.config.sample_stride * width) as f64 / 640.0).round().max(1.0) as usize
    }

    /// The plane whose inlier lies at a pixel, and the point of the plane there.
    fn inlier_at(
        &self,
        depth: &DepthImage,
        extraction: &Extraction,
        u: usize,
        v: usize,
    ) -> Option<(usize, Point)> {
        let index = extraction.segment_at(u, v)?;
        let place = (*self.places.get(index)?)?;
        let (a, b, z) = (self.ray_x[u], self.ray_y[v], depth.at(u, v));
        if z > self.config.max_sample_depth as f32 || !self.trials[index].is_inlier(z, a as f32, b as f32) {
            return None;
        }
        // Onto the plane along its normal, so that noise does not blur the patch.
        let fit = &self.fits[index];
        let z = f64::from(z);
        let point = [a * z, b * z, z];
        let distance = dot(fit.normal, point) - dot(fit.normal, fit.centroid);
        Some((place, std::array::from_fn(|axis| (point[axis] - distance * fit.normal[axis]) as f32)))
    }
}

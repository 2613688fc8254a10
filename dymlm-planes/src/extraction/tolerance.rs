use dymlm_core::vector3::{dot, norm};

use super::ExtractionConfig;
use crate::linear_algebra::eigenvalues;
use crate::moments::{Fit, Moments};

/// The physical tolerances of Feng 2014, as functions of the depth.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    block: f64,
    merge: f64,
    per_depth_squared: f64,
    misfit: f64,
    misfit_factor: f64,
    max_misfit_per_depth_squared: f64,
    /// Variance of neighbouring blocks about their common plane at 1 m, as measured in the frame; it grows with z^4.
    unevenness: f64,
    max_bend: f64,
    cos_max_incidence: f64,
    jump: f64,
    jump_per_depth: f64,
    /// Cosines of the largest block angle at depths of 0, 0.25, .. 4 m.
    cos_block_angle: [f64; 17],
    pub(super) cos_merge_angle: f64,
    pub(super) cos_refine_angle: f64,
}

/// How many times the allowed misfit a single block may have.
const BLOCK_SLACK: f64 = 2.0;
/// Bends up to this many times the unevenness are none (both as variances).
const UNEVEN_BEND: f64 = 12.0;
/// Standard deviations of a misfit's estimate that make no cluster bent.
const MISFIT_DEVIATIONS: f64 = 3.0;

/// Depths between which the angle of neighbouring blocks widens, metres.
const NEAR: f64 = 0.5;
const FAR: f64 = 4.0;

impl Tolerance {
    pub(super) fn new(config: &ExtractionConfig) -> Self {
        let (near, far) = (config.block_angle_near_deg, config.block_angle_far_deg);
        let cos_block_angle = std::array::from_fn(|quarter| {
            let part = ((0.25 * quarter as f64 - NEAR) / (FAR - NEAR)).clamp(0.0, 1.0);
            (near + part * (far - near)).to_radians().cos()
        });
        Self {
            block: config.block_tolerance,
            merge: config.merge_tolerance,
            per_depth_squared: config.tolerance_per_depth_squared,
            misfit: config.misfit,
            max_bend: config.max_bend,
            misfit_factor: config.misfit_factor,
            max_misfit_per_depth_squared: config.max_misfit_per_depth_squared,
            unevenness: 0.0,
            cos_max_incidence: config.max_incidence_deg.to_radians().cos(),
            jump: config.depth_jump,
            jump_per_depth: config.depth_jump_per_depth,
            cos_block_angle,
            cos_merge_angle: config.merge_angle_deg.to_radians().cos(),
            cos_refine_angle: config.refine_angle_deg.to_radians().cos(),
        }
    }

    /// Sets how uneven neighbouring blocks are: the variance about their common plane over z^4.
    pub(super) fn set_unevenness(&mut self, unevenness: f64) {
        let most = self.max_misfit_per_depth_squared / self.misfit_factor;
        self.unevenness = unevenness.min(most * most);
    }

    /// How far a pair of neighbouring blocks is from their common plane, beyond their noise, over z^4; `None` when they have
    /// none.
    pub(super) fn unevenness_of(moments: [&Moments; 2], fits: [&Fit; 2]) -> Option<f64> {
        let sum = moments[0].plus(moments[1]);
        let both = sum.fit()?;
        let noise =
            (fits[0].depth_mse * moments[0].weight + fits[1].depth_mse * moments[1].weight) / sum.weight;
        let slant = dot(both.normal, both.centroid) / both.centroid[2];
        Some((both.depth_mse - noise).max(0.0) * slant * slant / both.centroid[2].powi(4))
    }

    /// Whether a block is flat, and not seen so steeply that it may be a step between two surfaces.
    #[inline]
    pub(super) fn holds_block(&self, fit: &Fit) -> bool {
        fit.mse < self.largest_mse(self.block, fit) && cosine_of_incidence(fit) > self.cos_max_incidence
    }

    /// Whether a merged plane is flat.
    #[inline]
    pub(super) fn holds_plane(&self, fit: &Fit) -> bool {
        fit.mse < self.largest_mse(self.merge, fit)
    }

    /// Largest mean squared distance of any merged plane at mean depth z.
    #[inline]
    pub(super) fn merge_mse(&self, z: f64) -> f64 {
        let rms = self.merge + self.per_depth_squared * z * z;
        rms * rms
    }

    /// Whether a cluster is bent: a strip of something round, as wide as the misfit allows.
    pub(super) fn is_bent(&self, cluster: &Moments, noise: f64, fit: &Fit) -> bool {
        let z = fit.centroid[2];
        let slant = dot(fit.normal, fit.centroid) / z;
        let misfit = fit.depth_mse - noise;
        // A variance estimated from n readings errs by sqrt(2 / n) of itself.
        let error = MISFIT_DEVIATIONS * noise * (2.0 / cluster.weight).sqrt();
        // Of points spread evenly over a width w the variance is w^2 / 12.
        let [_, across, _] = eigenvalues(&cluster.covariance());
        let width = (12.0 * across.max(0.0)).sqrt();
        let uneven = UNEVEN_BEND * self.unevenness * z.powi(4);
        (misfit - error) * slant * slant > (self.max_bend * width).powi(2) + uneven
    }

    /// Noise runs along the ray, so its share across the plane falls with the angle of incidence; a plane laid through a
    /// step of depth is steep, and its misfit is not.
    #[inline]
    fn largest_mse(&self, at_zero: f64, fit: &Fit) -> f64 {
        let slant = dot(fit.normal, fit.centroid).abs() * fit.centroid[2];
        let rms = at_zero + self.per_depth_squared * slant;
        rms * rms
    }

    /// Whether a part lies on a plane but for its noise, the mean squared distance in depth of its points from the planes of
    /// their blocks.
    #[inline]
    pub(super) fn is_part(&self, part: &Moments, noise: f64, plane: &Fit) -> bool {
        self.misfit_share(part, noise, plane) < 1.0
    }

    /// Whether a single block lies on a plane: among thousands of blocks some are off by twice the usual.
    #[inline]
    pub(super) fn is_block_of(&self, block: &Moments, noise: f64, plane: &Fit) -> bool {
        self.misfit_share(block, noise, plane) < BLOCK_SLACK * BLOCK_SLACK
    }

    /// Squared misfit over the squared misfit that is allowed.
    #[inline]
    fn misfit_share(&self, part: &Moments, noise: f64, plane: &Fit) -> f64 {
        let centroid = part.centroid();
        let z = centroid[2];
        let slant = dot(plane.normal, centroid) / z;
        let misfit = part.mse_about(plane.normal, plane.centroid) - noise * slant * slant;
        misfit / (self.misfit * self.misfit + self.misfit_factor.powi(2) * self.unevenness * z.powi(4))
    }

    /// Smallest cosine between the normals of neighbouring blocks at depth z.
    #[inline]
    pub(super) fn cos_block_angle(&self, z: f64) -> f64 {
        self.cos_block_angle[((z * 4.0) as usize).min(16)]
    }

    /// Smallest difference of neighbouring depths that is an edge.
    #[inline]
    pub(super) fn jump(&self, z: f32) -> f32 {
        self.jump as f32 + self.jump_per_depth as f32 * z
    }
}

/// Cosine of the angle between the plane's normal and the ray to its centroid.
#[inline]
fn cosine_of_incidence(fit: &Fit) -> f64 {
    dot(fit.normal, fit.centroid).abs() / norm(fit.centroid)
}

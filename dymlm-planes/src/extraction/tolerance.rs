use super::ExtractionConfig;
use crate::linear_algebra::{dot, norm};
use crate::moments::{Fit, Moments};

/// The physical tolerances of Feng 2014, as functions of the depth.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    block: f64,
    merge: f64,
    per_depth_squared: f64,
    misfit: f64,
    misfit_per_depth_squared: f64,
    cos_max_incidence: f64,
    jump: f64,
    jump_per_depth: f64,
    /// Cosines of the largest block angle at depths of 0, 0.25, .. 4 m.
    cos_block_angle: [f64; 17],
    pub(super) cos_merge_angle: f64,
    pub(super) cos_refine_angle: f64,
}

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
            misfit_per_depth_squared: config.misfit_per_depth_squared,
            cos_max_incidence: config.max_incidence_deg.to_radians().cos(),
            jump: config.depth_jump,
            jump_per_depth: config.depth_jump_per_depth,
            cos_block_angle,
            cos_merge_angle: config.merge_angle_deg.to_radians().cos(),
            cos_refine_angle: config.refine_angle_deg.to_radians().cos(),
        }
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
        let centroid = part.centroid();
        let z = centroid[2];
        let misfit = self.misfit + self.misfit_per_depth_squared * z * z;
        let slant = dot(plane.normal, centroid) / z;
        part.mse_about(plane.normal, plane.centroid) - noise * slant * slant < misfit * misfit
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

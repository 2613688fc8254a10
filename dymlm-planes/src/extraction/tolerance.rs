use super::ExtractionConfig;

/// The physical tolerances of Feng 2014, as functions of the depth.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    block: f64,
    merge: f64,
    per_depth_squared: f64,
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
            jump: config.depth_jump,
            jump_per_depth: config.depth_jump_per_depth,
            cos_block_angle,
            cos_merge_angle: config.merge_angle_deg.to_radians().cos(),
            cos_refine_angle: config.refine_angle_deg.to_radians().cos(),
        }
    }

    /// Largest mean squared distance of a block at depth z.
    #[inline]
    pub(super) fn block_mse(&self, z: f64) -> f64 {
        let rms = self.block + self.per_depth_squared * z * z;
        rms * rms
    }

    /// Largest mean squared distance of a merged plane at mean depth z.
    #[inline]
    pub(super) fn merge_mse(&self, z: f64) -> f64 {
        let rms = self.merge + self.per_depth_squared * z * z;
        rms * rms
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

use dymlm_core::{ConfigError, check_range};

/// Settings of plane extraction. Lengths in pixels are those of an image 640 pixels wide and scale with the width.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ExtractionConfig {
    /// Nearest depth that takes part, metres, 0..=100. Default 0.3: below it structured light reads nothing.
    pub min_depth: f64,
    /// Farthest depth that takes part, metres, 0.1..=100. Default 4.6: a little more than the filter lets pass, so
    /// that planes at the end of its range are not cut.
    pub max_depth: f64,
    /// Side of a block, pixels at 640 of width, 4..=64. Default 8; with Feng's 10 narrow faces, a seat or a desk's side
    /// seen at 70 degrees, hold no two whole blocks side by side.
    pub block_size: usize,
    /// Share of a block's pixels that must have a reading, 0.1..=1. Default 0.5; Feng 2014 demands all, but a Kinect
    /// leaves holes.
    pub min_block_fill: f64,
    /// Fewest pixels of a plane, at 640x480, 10..=1000000. Default 500: a face of 0.08 m2 at 3 m seen at 75 degrees.
    /// (Feng 2014 wants 3000.)
    pub min_support: usize,
    /// A block or plane may have this root mean square distance from its fit, metres: this, 0..=1, default 0.005
    /// (Feng 2014, for blocks) ...
    pub block_tolerance: f64,
    /// ... or this, for merging planes, 0..=1, default 0.008 (Feng 2014) ...
    pub merge_tolerance: f64,
    /// ... plus this times the depth squared and the cosine of incidence, 1 / metres, 0..=1. Default 0.0022: with it
    /// blocks pass at 4 m as well, where a Kinect's noise and disparity steps come to 2.9 cm. (Feng 2014: 0.0016, without the
    /// cosine; the misfit below allows more.)
    pub tolerance_per_depth_squared: f64,
    /// A part joins a plane when the plane's misfit to it, beyond the part's own noise, is at most this, metres, 0..=1,
    /// default 0.003 ...
    pub misfit: f64,
    /// ... and, as variances add, this many times the unevenness of neighbouring blocks, 1..=100. The unevenness is the
    /// frame's median: with pure noise an eighth of it, with a Kinect's disparity steps more. Default 6.5.
    pub misfit_factor: f64,
    /// The second part is at most this times the depth squared, 1 / metres, 0..=1. Default 0.002: two thirds of a Kinect's
    /// disparity step.
    pub max_misfit_per_depth_squared: f64,
    /// A plane's misfit is at most this share of its width, 0..=1. Default 0.008: a strip of a round thing that spans 12
    /// degrees of it. The error of the estimate and the unevenness of the sensor are allowed in addition.
    pub max_bend: f64,
    /// Largest angle between a block's normal and its ray, degrees, 1..=90. Default 84: beyond it a Kinect reads hardly
    /// anything (Nguyen 2012), and what looks like a plane is a step between two.
    pub max_incidence_deg: f64,
    /// Neighbouring pixels belong to one surface when their depths differ by less than this, metres, 0..=1, default
    /// 0.02 (Feng 2014) ...
    pub depth_jump: f64,
    /// ... plus this times the depth, 0..=1. Default 0.04 (Feng 2014).
    pub depth_jump_per_depth: f64,
    /// Largest angle between neighbouring blocks at 0.5 m and nearer, degrees, 1..=90. Default 15 (Feng 2014).
    pub block_angle_near_deg: f64,
    /// Largest angle between neighbouring blocks at 4 m and farther, degrees, 1..=90; linear in between. Default 90
    /// (Feng 2014): there a block's normal is all noise.
    pub block_angle_far_deg: f64,
    /// Largest angle between planes that merge while clustering, degrees, 1..=90. Default 60 (Feng 2014).
    pub merge_angle_deg: f64,
    /// Largest angle between planes that merge in the end, degrees, 1..=90. Default 30 (Feng 2014).
    pub refine_angle_deg: f64,
    /// Pixels join a plane up to this many of its root mean square distances, 1..=10. Default 2.5 (Feng 2014: 3).
    pub growing_distance: f64,
}

impl Default for ExtractionConfig {
    fn default() -> Self {
        Self {
            min_depth: 0.3,
            max_depth: 4.6,
            block_size: 8,
            min_block_fill: 0.5,
            min_support: 500,
            block_tolerance: 0.005,
            merge_tolerance: 0.008,
            tolerance_per_depth_squared: 0.0022,
            misfit: 0.003,
            misfit_factor: 6.5,
            max_misfit_per_depth_squared: 0.002,
            max_bend: 0.008,
            max_incidence_deg: 84.0,
            depth_jump: 0.02,
            depth_jump_per_depth: 0.04,
            block_angle_near_deg: 15.0,
            block_angle_far_deg: 90.0,
            merge_angle_deg: 60.0,
            refine_angle_deg: 30.0,
            growing_distance: 2.5,
        }
    }
}

impl ExtractionConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("planes.extraction.min_depth", self.min_depth, 0.0..=100.0)?;
        check_range("planes.extraction.max_depth", self.max_depth, self.min_depth.max(0.1)..=100.0)?;
        check_range("planes.extraction.block_size", self.block_size as f64, 4.0..=64.0)?;
        check_range("planes.extraction.min_block_fill", self.min_block_fill, 0.1..=1.0)?;
        check_range("planes.extraction.min_support", self.min_support as f64, 10.0..=1e6)?;
        check_range("planes.extraction.block_tolerance", self.block_tolerance, 0.0..=1.0)?;
        check_range("planes.extraction.merge_tolerance", self.merge_tolerance, 0.0..=1.0)?;
        let per_square = self.tolerance_per_depth_squared;
        check_range("planes.extraction.tolerance_per_depth_squared", per_square, 0.0..=1.0)?;
        check_range("planes.extraction.misfit", self.misfit, 0.0..=1.0)?;
        check_range("planes.extraction.misfit_factor", self.misfit_factor, 1.0..=100.0)?;
        let per_square = self.max_misfit_per_depth_squared;
        check_range("planes.extraction.max_misfit_per_depth_squared", per_square, 0.0..=1.0)?;
        check_range("planes.extraction.max_bend", self.max_bend, 0.0..=1.0)?;
        check_range("planes.extraction.max_incidence_deg", self.max_incidence_deg, 1.0..=90.0)?;
        check_range("planes.extraction.depth_jump", self.depth_jump, 0.0..=1.0)?;
        check_range("planes.extraction.depth_jump_per_depth", self.depth_jump_per_depth, 0.0..=1.0)?;
        check_range("planes.extraction.block_angle_near_deg", self.block_angle_near_deg, 1.0..=90.0)?;
        check_range("planes.extraction.block_angle_far_deg", self.block_angle_far_deg, 1.0..=90.0)?;
        check_range("planes.extraction.merge_angle_deg", self.merge_angle_deg, 1.0..=90.0)?;
        check_range("planes.extraction.refine_angle_deg", self.refine_angle_deg, 1.0..=90.0)?;
        check_range("planes.extraction.growing_distance", self.growing_distance, 1.0..=10.0)
    }
}

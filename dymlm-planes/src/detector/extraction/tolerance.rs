use dymlm_core::symmetric_eigen3;
use dymlm_core::vector3::{dot, norm};

use crate::linear_algebra::rows;
use crate::moments::{Fit, Moments};

/// The physical tolerances of Feng 2014, as functions of the depth.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    /// Variance of neighbouring blocks about their common plane at 1 m, as measured in the frame; it grows with z^4.
    unevenness: f64,
    /// Cosines of the largest block angle at depths of 0, 0.25, .. 4 m.
    cos_block_angle: [f64; 17],
}

/// A block may have this root mean square distance from its fit, metres (Feng 2014) ...
const BLOCK_TOLERANCE: f64 = 0.005;
/// ... and merged planes this (Feng 2014) ...
const MERGE_TOLERANCE: f64 = 0.008;
/// ... plus this times the depth squared and the cosine of incidence, 1 / metres: with it blocks pass at 4 m as well, where
/// a Kinect's noise and disparity steps come to 2.9 cm. (Feng 2014: 0.0016, without the cosine; the misfit below allows more.)
const TOLERANCE_PER_DEPTH_SQUARED: f64 = 0.0022;
/// A part joins a plane when the plane's misfit to it, beyond the part's own noise, is at most this, metres ...
const MISFIT: f64 = 0.003;
/// ... and, as variances add, this many times the unevenness of neighbouring blocks. The unevenness is the frame's median:
/// with pure noise an eighth of it, with a Kinect's disparity steps more.
const MISFIT_FACTOR: f64 = 6.5;
/// The second part is at most this times the depth squared, 1 / metres: two thirds of a Kinect's disparity step.
const MAX_MISFIT_PER_DEPTH_SQUARED: f64 = 0.002;
/// A plane's misfit is at most this share of its width: a strip of a round thing that spans 12 degrees of it. The error of
/// the estimate and the unevenness of the sensor are allowed in addition.
const MAX_BEND: f64 = 0.008;
/// Cosine of the largest angle between a block's normal and its ray, 84 degrees: beyond it a Kinect reads hardly anything
/// (Nguyen 2012), and what looks like a plane is a step between two.
const COS_MAX_INCIDENCE: f64 = 0.104_528;
/// Neighbouring pixels belong to one surface when their depths differ by less than this, metres (Feng 2014) ...
const JUMP: f32 = 0.02;
/// ... plus this times the depth (Feng 2014).
const JUMP_PER_DEPTH: f32 = 0.04;
/// Cosine of the largest angle between planes that merge while clustering: 60 degrees (Feng 2014).
pub(super) const COS_MERGE_ANGLE: f64 = 0.5;
/// Cosine of the largest angle between planes that merge in the end: 30 degrees (Feng 2014).
pub(super) const COS_REFINE_ANGLE: f64 = 0.866_025;

/// How many times the allowed misfit a single block may have.
const BLOCK_SLACK: f64 = 2.0;
/// Bends up to this many times the unevenness are none (both as variances).
const UNEVEN_BEND: f64 = 12.0;
/// Standard deviations of a misfit's estimate that make no cluster bent.
const MISFIT_DEVIATIONS: f64 = 3.0;

/// Largest angle between neighbouring blocks, degrees, at the nearer and the farther of two depths, metres; linear in
/// between (Feng 2014): far away a block's normal is all noise.
const BLOCK_ANGLES: [f64; 2] = [15.0, 90.0];
const NEAR: f64 = 0.5;
const FAR: f64 = 4.0;

impl Tolerance {
    pub(super) fn new() -> Self {
        let [near, far] = BLOCK_ANGLES;
        let cos_block_angle = std::array::from_fn(|quarter| {
            let part = ((0.25 * quarter as f64 - NEAR) / (FAR - NEAR)).clamp(0.0, 1.0);
            (near + part * (far - near)).to_radians().cos()
        });
        Self { unevenness: 0.0, cos_block_angle }
    }

    /// Sets how uneven neighbouring blocks are: the variance about their common plane over z^4.
    pub(super) fn set_unevenness(&mut self, unevenness: f64) {
        let most = MAX_MISFIT_PER_DEPTH_SQUARED / MISFIT_FACTOR;
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
    pub(super) fn holds_block(fit: &Fit) -> bool {
        fit.mse < Self::largest_mse(BLOCK_TOLERANCE, fit) && cosine_of_incidence(fit) > COS_MAX_INCIDENCE
    }

    /// Whether a merged plane is flat.
    #[inline]
    pub(super) fn holds_plane(fit: &Fit) -> bool {
        fit.mse < Self::largest_mse(MERGE_TOLERANCE, fit)
    }

    /// Largest mean squared distance of any merged plane at mean depth z.
    #[inline]
    pub(super) fn merge_mse(z: f64) -> f64 {
        let rms = MERGE_TOLERANCE + TOLERANCE_PER_DEPTH_SQUARED * z * z;
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
        let across = symmetric_eigen3(rows(&cluster.covariance())).map_or(0.0, |eigen| eigen.values[1]);
        let width = (12.0 * across.max(0.0)).sqrt();
        let uneven = UNEVEN_BEND * self.unevenness * z.powi(4);
        (misfit - error) * slant * slant > (MAX_BEND * width).powi(2) + uneven
    }

    /// Noise runs along the ray, so its share across the plane falls with the angle of incidence; a plane laid through a
    /// step of depth is steep, and its misfit is not.
    #[inline]
    fn largest_mse(at_zero: f64, fit: &Fit) -> f64 {
        let slant = dot(fit.normal, fit.centroid).abs() * fit.centroid[2];
        let rms = at_zero + TOLERANCE_PER_DEPTH_SQUARED * slant;
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
        misfit / (MISFIT * MISFIT + MISFIT_FACTOR.powi(2) * self.unevenness * z.powi(4))
    }

    /// Smallest cosine between the normals of neighbouring blocks at depth z.
    #[inline]
    pub(super) fn cos_block_angle(&self, z: f64) -> f64 {
        self.cos_block_angle[((z * 4.0) as usize).min(16)]
    }

    /// Smallest difference of neighbouring depths that is an edge.
    #[inline]
    pub(super) fn jump(z: f32) -> f32 {
        JUMP + JUMP_PER_DEPTH * z
    }
}

/// Cosine of the angle between the plane's normal and the ray to its centroid.
#[inline]
fn cosine_of_incidence(fit: &Fit) -> f64 {
    dot(fit.normal, fit.centroid).abs() / norm(fit.centroid)
}

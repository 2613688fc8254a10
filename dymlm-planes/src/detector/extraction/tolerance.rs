use dymlm_core::SensorModel;
use dymlm_core::vector3::dot;

use crate::linear_algebra::{self, rows};
use crate::moments::{Fit, Moments};

/// The tolerances of Feng 2014 as functions of the sensor's noise sigma(z); Feng's are for a Kinect.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    sensor: SensorModel,
    /// Variance of neighbouring blocks about their common plane beyond their noise, measured in the frame,
    /// relative to the sensor's variance.
    unevenness: f64,
}

/// Largest root mean square distance of a block's or plane's points from its fit, metres (Feng 2014) ...
const FLATNESS: f64 = 0.008;
/// ... plus this many sigma(z) times the cosine of the angle of incidence. With 1 the blocks at the end of
/// the range are no nodes, with more a block across a step is one.
/// `far_walls_are_planes_as_far_as_the_sensor_is_used` fails with 0.
const TOLERANCE_SIGMAS: f64 = 1.4;
/// Largest misfit of a plane to a part that joins it, beyond the part's own noise, metres (with 0 the rim of
/// a pillar is a plane: `a_cylinder_yields_no_plane`) ...
const MISFIT: f64 = 0.003;
/// ... plus, added as variances, this many times the unevenness of neighbouring blocks. The unevenness is the
/// frame's median: with pure noise an eighth of the noise, with a Kinect's disparity steps more.
const MISFIT_FACTOR: f64 = 6.5;
/// Largest misfit of a plane, as a share of its width: that of a strip that spans 12 degrees of a round
/// thing. The unevenness of the sensor is allowed in addition. With 0 the planes of an exact image count as
/// bent (`labels_agree_with_a_rendered_room`); without a limit strips of round things are planes.
const MAX_BEND: f64 = 0.008;
/// Cosine of the largest angle between planes that merge while clustering: 60 degrees (Feng 2014).
pub(super) const COS_MERGE_ANGLE: f64 = 0.5;
/// Largest misfit, in units of the unevenness (both as variances), that does not count as a bend. With 0 the
/// planes of a sensor with disparity steps count as bent (recall 90 to 77 %); with 9 precision rises from 98
/// to 99 %, but a chair of the kitchen loses its place (`each_thing_is_there_once`).
const UNEVEN_BEND: f64 = 12.0;

/// Width of a cluster perpendicular to its longest extent, metres.
pub(super) fn width(cluster: &Moments) -> f64 {
    linear_algebra::width(rows(&cluster.covariance()))
}

impl Tolerance {
    /// The unevenness where a frame has too few neighbouring blocks to measure it.
    pub(super) const UNMEASURED: f64 = 0.0;

    pub(super) fn new(sensor: SensorModel) -> Self {
        Self { sensor, unevenness: Self::UNMEASURED }
    }

    /// Variance of a reading at depth `z`, square metres.
    #[inline]
    pub(super) fn variance(&self, z: f64) -> f64 {
        f64::from(self.sensor.sigma(z as f32)).powi(2)
    }

    /// Sets the unevenness of neighbouring blocks, see [`Self::unevenness_of`].
    pub(super) fn set_unevenness(&mut self, unevenness: f64) {
        self.unevenness = unevenness;
    }

    /// Misfit of a pair of neighbouring blocks to their common plane, beyond their noise, as a variance
    /// relative to the sensor's; `None` when they have no common plane.
    pub(super) fn unevenness_of(&self, moments: [&Moments; 2], fits: [&Fit; 2]) -> Option<f64> {
        let sum = moments[0].plus(moments[1]);
        let both = sum.fit()?;
        let noise =
            (fits[0].depth_mse * moments[0].weight + fits[1].depth_mse * moments[1].weight) / sum.weight;
        let z = both.centroid[2];
        let slant = dot(both.normal, both.centroid) / z;
        Some((both.depth_mse - noise).max(0.0) * slant * slant / self.variance(z))
    }

    /// Whether a block or a merged plane is flat. Noise acts along the ray, so its effect across the plane
    /// falls with the angle of incidence. A plane fitted across a step in depth is steep, so less noise is
    /// allowed, but its misfit stays.
    #[inline]
    pub(super) fn holds(&self, fit: &Fit) -> bool {
        let z = fit.centroid[2];
        let slant = dot(fit.normal, fit.centroid).abs() / z;
        let rms = FLATNESS + TOLERANCE_SIGMAS * f64::from(self.sensor.sigma(z as f32)) * slant;
        fit.mse < rms * rms
    }

    /// Largest mean squared distance of a merged plane, at any slant, at mean depth z.
    #[inline]
    pub(super) fn merge_mse(&self, z: f64) -> f64 {
        let rms = FLATNESS + TOLERANCE_SIGMAS * f64::from(self.sensor.sigma(z as f32));
        rms * rms
    }

    /// Whether a cluster of this [`width`] is bent, as a strip of something round is.
    pub(super) fn is_bent(&self, width: f64, noise: f64, fit: &Fit) -> bool {
        let z = fit.centroid[2];
        let slant = dot(fit.normal, fit.centroid) / z;
        let uneven = UNEVEN_BEND * self.unevenness * self.variance(z);
        (fit.depth_mse - noise) * slant * slant > (MAX_BEND * width).powi(2) + uneven
    }

    /// Whether a part lies on a plane, apart from its noise: the mean squared distance in depth of its points
    /// from the planes of their blocks.
    #[inline]
    pub(super) fn is_part(&self, part: &Moments, noise: f64, plane: &Fit) -> bool {
        let centroid = part.centroid();
        let z = centroid[2];
        let slant = dot(plane.normal, centroid) / z;
        let misfit = part.mse_about(plane.normal, plane.centroid) - noise * slant * slant;
        misfit < MISFIT * MISFIT + MISFIT_FACTOR.powi(2) * self.unevenness * self.variance(z)
    }
}

use dymlm_core::vector3::dot;
use dymlm_core::{SensorModel, symmetric_eigen3};

use crate::linear_algebra::rows;
use crate::moments::{Fit, Moments};

/// The tolerances of Feng 2014, as functions of the sensor's noise sigma(z); Feng's are for a Kinect's.
#[derive(Debug, Clone)]
pub(super) struct Tolerance {
    sensor: SensorModel,
    /// Variance of neighbouring blocks about their common plane beyond their noise, as measured in the frame,
    /// over the sensor's variance.
    unevenness: f64,
}

/// Blocks and merged planes may have this root mean square distance from their fit, metres (Feng 2014) ...
const FLATNESS: f64 = 0.008;
/// ... plus so many sigma(z) times the cosine of incidence: with 1 the blocks at the end of the range are no
/// nodes, with more a block over a step is one. `far_walls_are_planes_as_far_as_the_sensor_is_used` fails
/// with 0.
const TOLERANCE_SIGMAS: f64 = 1.4;
/// A part joins a plane when the plane's misfit to it, beyond the part's own noise, is at most this, metres
/// (with 0 the rim of a pillar is a plane: `a_cylinder_yields_no_plane`) ...
const MISFIT: f64 = 0.003;
/// ... and, as variances add, this many times the unevenness of neighbouring blocks. The
/// unevenness is the frame's median: with pure noise an eighth of it, with a Kinect's disparity steps more.
const MISFIT_FACTOR: f64 = 6.5;
/// A plane's misfit is at most this share of its width: a strip of a round thing that spans 12 degrees of it.
/// The unevenness of the sensor is allowed in addition. With 0 the planes of an exact image are bent
/// (`labels_agree_with_a_rendered_room`); without a limit strips of round things are planes.
const MAX_BEND: f64 = 0.008;
/// Cosine of the largest angle between planes that merge while clustering: 60 degrees (Feng 2014).
pub(super) const COS_MERGE_ANGLE: f64 = 0.5;
/// Bends up to this many times the unevenness are none (both as variances). With 0 planes of a sensor with
/// disparity steps are bent (recall 90 to 77 %); with 9 precision rises from 98 to 99 %,
/// but a chair of the kitchen loses its place (`each_thing_is_there_once`).
const UNEVEN_BEND: f64 = 12.0;

/// How wide a cluster is across its longest extent, metres. Of points spread evenly over a width w the
/// variance is w^2 / 12.
pub(super) fn width(cluster: &Moments) -> f64 {
    let across = symmetric_eigen3(rows(&cluster.covariance())).map_or(0.0, |eigen| eigen.values[1]);
    (12.0 * across.max(0.0)).sqrt()
}

impl Tolerance {
    pub(super) fn new(sensor: SensorModel) -> Self {
        Self { sensor, unevenness: 0.0 }
    }

    /// Variance of a reading at depth `z`, square metres.
    #[inline]
    pub(super) fn variance(&self, z: f64) -> f64 {
        f64::from(self.sensor.sigma(z as f32)).powi(2)
    }

    /// Sets how uneven neighbouring blocks are, see [`Self::unevenness_of`].
    pub(super) fn set_unevenness(&mut self, unevenness: f64) {
        self.unevenness = unevenness;
    }

    /// How far a pair of neighbouring blocks is from their common plane, beyond their noise, as a variance
    /// over the sensor's; `None` when they have none.
    pub(super) fn unevenness_of(&self, moments: [&Moments; 2], fits: [&Fit; 2]) -> Option<f64> {
        let sum = moments[0].plus(moments[1]);
        let both = sum.fit()?;
        let noise =
            (fits[0].depth_mse * moments[0].weight + fits[1].depth_mse * moments[1].weight) / sum.weight;
        let z = both.centroid[2];
        let slant = dot(both.normal, both.centroid) / z;
        Some((both.depth_mse - noise).max(0.0) * slant * slant / self.variance(z))
    }

    /// Whether a block or a merged plane is flat. Noise runs along the ray, so its share across the plane
    /// falls with the angle of incidence; a plane laid through a step of depth is steep, and its misfit is
    /// not.
    #[inline]
    pub(super) fn holds(&self, fit: &Fit) -> bool {
        let z = fit.centroid[2];
        let slant = dot(fit.normal, fit.centroid).abs() / z;
        let rms = FLATNESS + TOLERANCE_SIGMAS * f64::from(self.sensor.sigma(z as f32)) * slant;
        fit.mse < rms * rms
    }

    /// Largest mean squared distance of any merged plane at mean depth z.
    #[inline]
    pub(super) fn merge_mse(&self, z: f64) -> f64 {
        let rms = FLATNESS + TOLERANCE_SIGMAS * f64::from(self.sensor.sigma(z as f32));
        rms * rms
    }

    /// Whether a cluster of a [`width`] is bent: a strip of something round, as wide as the misfit allows.
    pub(super) fn is_bent(&self, width: f64, noise: f64, fit: &Fit) -> bool {
        let z = fit.centroid[2];
        let slant = dot(fit.normal, fit.centroid) / z;
        let uneven = UNEVEN_BEND * self.unevenness * self.variance(z);
        (fit.depth_mse - noise) * slant * slant > (MAX_BEND * width).powi(2) + uneven
    }

    /// Whether a part lies on a plane but for its noise, the mean squared distance in depth of its points
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

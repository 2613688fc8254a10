use dymlm_core::vector3::dot;

use crate::linear_algebra::{plane_axes, quadratic_form};
use crate::moments::Moments;

/// Uncertainty of a plane: three degrees of freedom, taken at the plane's centroid, where tilt and offset are
/// independent.
///
/// The normal may tilt to n + a u + b v, with (u, v) the plane's [axes](Self::axes) and small angles a, b in
/// radians, and the plane may shift by s metres along n.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PlaneCovariance {
    /// Unit vectors u and v in the plane; (u, v, n) is right-handed.
    pub axes: [[f64; 3]; 2],
    /// The point at which tilt and offset are taken, metres.
    pub centroid: [f64; 3],
    /// Covariance of the angles a and b, square radians: aa, ab, bb.
    pub tilt: [f64; 3],
    /// Variance of the shift s, square metres.
    pub offset: f64,
}

impl PlaneCovariance {
    /// From the inliers' sums with weights 1 / variance, for the plane with this unit `normal`. `inflation`
    /// multiplies all variances. `None` when the inliers lie on a line.
    pub(crate) fn new(moments: &Moments, normal: [f64; 3], inflation: f64) -> Option<Self> {
        let axes = plane_axes(normal);
        let covariance = moments.covariance();
        let [u, v] = axes;
        let uu = quadratic_form(&covariance, u);
        let vv = quadratic_form(&covariance, v);
        let sum: [f64; 3] = std::array::from_fn(|i| u[i] + v[i]);
        let uv = 0.5 * (quadratic_form(&covariance, sum) - uu - vv);
        let determinant = uu * vv - uv * uv;
        let flat = determinant > 1e-9 * (uu + vv) * (uu + vv);
        let scale = inflation / moments.weight;
        flat.then(|| Self {
            axes,
            centroid: moments.centroid(),
            tilt: [vv, -uv, uu].map(|entry| scale * entry / determinant),
            offset: scale,
        })
    }

    /// The covariance of (n, d), n . x + d = 0: 4x4, of rank 3, because n has unit length.
    pub fn of_parameters(&self) -> [[f64; 4]; 4] {
        // d = -n . c - s.
        let column = |axis: [f64; 3]| [axis[0], axis[1], axis[2], -dot(axis, self.centroid)];
        let (u, v) = (column(self.axes[0]), column(self.axes[1]));
        let [aa, ab, bb] = self.tilt;
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let offset = if i == 3 && j == 3 { self.offset } else { 0.0 };
                aa * u[i] * u[j] + ab * (u[i] * v[j] + v[i] * u[j]) + bb * v[i] * v[j] + offset
            })
        })
    }

    /// Standard deviation of the normal's direction about its more uncertain axis, radians.
    pub fn angle_deviation(&self) -> f64 {
        let [aa, ab, bb] = self.tilt;
        let half = 0.5 * (aa - bb);
        (0.5 * (aa + bb) + (half * half + ab * ab).sqrt()).sqrt()
    }

    /// Standard deviation of the distance by which the plane's tilt moves its long rims, metres, of inliers
    /// spread evenly over the plane: the rims are sqrt(3) times the inliers' deviation from the middle, and
    /// the tilt is as uncertain as the offset over that deviation.
    pub(crate) fn rim_deviation(&self) -> f64 {
        (3.0 * self.offset).sqrt()
    }

    /// Standard deviation of the offset at the centroid, metres.
    pub fn offset_deviation(&self) -> f64 {
        self.offset.sqrt()
    }
}

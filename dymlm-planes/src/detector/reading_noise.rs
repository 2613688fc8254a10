use dymlm_core::vector3::dot;
use dymlm_core::{PinholeCamera, SensorModel};

use crate::moments::Fit;

/// Standard deviation of the image position to which a reading belongs, pixels of a Kinect (Nguyen 2012).
/// With 0 slanted blocks count as rough (recall of faces 77 instead of 92 %).
const LATERAL: f64 = 0.8;

/// The noise of a camera's readings on a plane. It has two parts: the sensor's, which acts along the ray and so
/// moves readings off the plane the less the more it is slanted, and that of the image position, which does so the
/// more.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReadingNoise {
    sensor: SensorModel,
    /// Deviation of the image position at depth 1, along x and y, metres.
    lateral: [f64; 2],
}

impl ReadingNoise {
    pub(super) fn new(sensor: SensorModel, camera: &PinholeCamera) -> Self {
        let pixels = LATERAL * camera.focal_scale();
        Self { sensor, lateral: [camera.fx(), camera.fy()].map(|focal_length| pixels / focal_length) }
    }

    /// Deviation across a plane, metres, of readings where the ray (x, y, 1) meets it.
    pub(super) fn deviation_across(&self, plane: &Fit, [x, y]: [f64; 2]) -> f64 {
        let along = dot(plane.normal, [x, y, 1.0]);
        let z = (dot(plane.normal, plane.centroid) / along).clamp(0.0, self.sensor.max_depth.into());
        (f64::from(self.sensor.sigma(z as f32)) * along).hypot(self.lateral_deviation(plane, z))
    }

    /// Variance along the optical axis that comes from the noise of the image positions, square metres.
    pub(super) fn lateral_variance_in_depth(&self, plane: &Fit) -> f64 {
        let z = plane.centroid[2];
        let slant = dot(plane.normal, plane.centroid) / z;
        (self.lateral_deviation(plane, z) / slant).powi(2)
    }

    /// Deviation across a plane, at depth z, that comes from the noise of the image positions, metres.
    fn lateral_deviation(&self, plane: &Fit, z: f64) -> f64 {
        let [x, y] = [0, 1].map(|axis| plane.normal[axis] * self.lateral[axis]);
        x.hypot(y) * z
    }
}

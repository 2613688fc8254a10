use dymlm_core::SensorModel;

/// How far apart in depth two neighbours on one surface may be: by the sensor's noise, by how much a surface
/// recedes from one sample to the next, and by a constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DepthRadius {
    pub(super) sensor: SensorModel,
    /// Distance of two samples at a depth of 1 m, metres.
    pub(super) pitch: f32,
    /// The constant, metres.
    pub(super) least: f32,
}

/// Standard deviations of noise in the radius: chains of neighbours form the clusters, so two are as good as
/// three.
const SIGMAS: f32 = 2.0;
/// Greatest slope of a surface against the image, as a tangent: 54 degrees. A value of 2 joins people who sit
/// with the desk before them: `evaluate --quick` falls below its limits for the sitting sequence (the
/// accuracy of what moves falls from 76 to 65 %). A lower value splits surfaces that are seen at a grazing
/// angle.
const SLOPE: f32 = 1.4;

impl DepthRadius {
    /// The radius at depth `z`, metres.
    #[inline]
    pub(super) fn at(&self, z: f32) -> f32 {
        self.least + SIGMAS * self.sensor.sigma(z) + SLOPE * self.pitch * z
    }
}

/// Depths in units of a radius that grows with depth: the integral of 1 / radius, so that one radius of 1
/// serves all depths.
#[derive(Debug, Clone, Default)]
pub(super) struct DepthScale {
    radius: Option<DepthRadius>,
    /// The integral up to each of the tabulated depths.
    sums: Vec<f32>,
}

/// Tabulated depths per metre: the noise hardly changes in between.
const STEPS_PER_METRE: u16 = 50;
/// Number of tabulated depths: up to 20 m. Beyond, the radius stays constant.
const STEPS: usize = 1000;

impl DepthScale {
    /// Computes the scale for a radius.
    pub(super) fn set(&mut self, radius: &DepthRadius) {
        if self.radius.as_ref() == Some(radius) {
            return;
        }
        self.radius = Some(*radius);
        self.sums.clear();
        let length = 1.0 / f32::from(STEPS_PER_METRE);
        let mut sum = 0.0_f64;
        for step in 0..=STEPS {
            self.sums.push(sum as f32);
            sum += f64::from(length / radius.at((step as f32 + 0.5) * length));
        }
    }

    /// The scaled depth of `z` >= 0 metres.
    #[inline]
    pub(super) fn at(&self, z: f32) -> f32 {
        let place = z / (1.0 / f32::from(STEPS_PER_METRE));
        let step = (place as usize).min(STEPS - 1);
        match self.sums.get(step..step + 2) {
            Some(&[low, high]) => low + (place - step as f32) * (high - low),
            _ => z,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_radius_apart_is_one_apart_at_every_depth() {
        let radius = DepthRadius { sensor: SensorModel::kinect(), pitch: 4.0 / 525.0, least: 0.01 };
        let mut scale = DepthScale::default();
        scale.set(&radius);
        for z in [0.3_f32, 0.5, 1.0, 2.0, 4.0, 8.0, 19.0] {
            let half = 0.5 * radius.at(z);
            let apart = scale.at(z + half) - scale.at(z - half);
            assert!((apart - 1.0).abs() < 0.01, "{apart} at {z} m");
        }
        assert!(scale.at(30.0) > scale.at(25.0));
    }
}

use dymlm_core::SensorModel;

use crate::rounding::round_to_i32;

/// Weight of the best reading; doubled as long as the farthest readings would lose their digits ...
const LEAST_UNIT: i32 = 1 << 12;
/// ... but not beyond this: the sums of 2^34 readings still fit into their 64 bits.
const GREATEST_UNIT: i32 = 1 << 21;
/// Least weight of the farthest reading: rounding changes it by an eighth at most. With a lower value, far
/// readings lose their digits (`far_readings_of_a_stereo_pair_keep_their_digits`); with a higher one, a
/// Kinect's sums would not be what they were.
const LEAST_WEIGHT: f32 = 4.0;

/// Weights of a sensor's readings: 1 / sigma(z)^2, as an integer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weighting {
    sensor: SensorModel,
    /// The weight of a reading with the sensor's least noise.
    unit: f32,
}

impl Weighting {
    pub(crate) fn new(sensor: SensorModel) -> Self {
        let least = sensor.noise.floor / sensor.sigma(sensor.max_depth);
        let mut unit = LEAST_UNIT;
        while unit < GREATEST_UNIT && (unit as f32) * least * least < LEAST_WEIGHT {
            unit *= 2;
        }
        Self { sensor, unit: unit as f32 }
    }

    pub(crate) fn sensor(&self) -> &SensorModel {
        &self.sensor
    }

    /// The weight of a reading at depth `z`; 0 when it is not used, else at least 1.
    #[inline]
    pub(crate) fn weight(&self, z: f32) -> u32 {
        let precision = self.sensor.noise.floor / self.sensor.sigma(z);
        let weight = round_to_i32(self.unit * precision * precision).max(1) as u32;
        if self.sensor.is_used(z) { weight } else { 0 }
    }

    /// A sum of weights in units of one reading with the sensor's least noise.
    #[inline]
    pub(crate) fn total(&self, weight: u64) -> f64 {
        // A cast of a signed number is one instruction.
        weight as i64 as f64 / f64::from(self.unit)
    }

    /// Variance of the best reading, which weighs 1 in [`total`](Self::total), square metres. For every
    /// reading it is the product of weight and variance.
    pub(crate) fn least_variance(&self) -> f64 {
        f64::from(self.sensor.noise.floor).powi(2)
    }

    /// Standard deviation of one of a voxel's readings along the line of sight, metres, from their mean
    /// weight. Near the camera, where several readings of a frame fall into the voxel, the result is too
    /// small.
    pub(crate) fn standard_deviation(&self, weight: u64, observations: u32) -> f64 {
        self.deviation_of(self.weight_per_frame(weight, observations))
    }

    /// Mean weight of a voxel's readings, in the units of [`total`](Self::total).
    #[inline]
    pub(crate) fn weight_per_frame(&self, weight: u64, observations: u32) -> f64 {
        self.total(weight) / f64::from(observations.max(1))
    }

    /// Standard deviation of readings with this mean weight, metres.
    pub(crate) fn deviation_of(&self, weight_per_frame: f64) -> f64 {
        f64::from(self.sensor.noise.floor) / weight_per_frame.max(1e-9).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::DepthNoise;

    use super::*;

    #[test]
    fn weights_follow_the_inverse_variance() {
        let weighting = Weighting::new(SensorModel { min_depth: 0.0, ..SensorModel::kinect() });
        assert_eq!(weighting.weight(0.4), 4096);
        assert_eq!(weighting.weight(0.1), 4096);
        let sigma = |z: f32| SensorModel::kinect().sigma(z);
        for z in [0.5, 1.0, 2.0, 3.0, 4.0] {
            let expected = (sigma(0.4) / sigma(z)).powi(2) * 4096.0;
            assert!((weighting.weight(z) as f32 - expected).abs() <= 0.5);
        }
        for unused in [0.0, -1.0, f32::NAN, f32::INFINITY, 4.51] {
            assert_eq!(weighting.weight(unused), 0);
        }
    }

    #[test]
    fn no_used_reading_of_any_sensor_is_weightless_or_too_heavy() {
        let hard = DepthNoise { floor: 1e-5, growth: 1.0, start: 0.0 };
        let noises =
            [DepthNoise::kinect(), DepthNoise::stereo(425.0, 0.05, 0.08), DepthNoise::constant(1.0), hard];
        for (noise, max_depth) in
            noises.into_iter().flat_map(|noise| [1.0, 4.5, 80.0].map(|far| (noise, far)))
        {
            let sensor = SensorModel { noise, max_depth, ..SensorModel::kinect() };
            let weighting = Weighting::new(sensor);
            let weights: Vec<u32> =
                (1..=100).map(|i| weighting.weight(max_depth * i as f32 / 100.0)).collect();
            let used: Vec<u32> = weights.into_iter().filter(|&weight| weight > 0).collect();
            assert!(used.is_sorted_by(|near, far| near >= far));
            assert!(used.iter().all(|&weight| weight <= GREATEST_UNIT as u32), "{noise:?}");
        }
    }

    #[test]
    fn far_readings_of_a_stereo_pair_keep_their_digits() {
        let sensor = SensorModel { max_depth: 10.0, ..SensorModel::realsense_d4xx() };
        let weighting = Weighting::new(sensor);
        let ratio = f64::from(weighting.weight(5.0)) / f64::from(weighting.weight(10.0));
        let expected = f64::from(sensor.sigma(10.0) / sensor.sigma(5.0)).powi(2);
        assert!((ratio / expected - 1.0).abs() < 0.15, "{ratio} instead of {expected}");
    }
}

use crate::{ConfigError, DepthNoise, check_range};

/// What is known of a depth camera beside its intrinsics: how its readings err, which of them are used, and
/// how densely.
///
/// It is given once, and all parts that need a depth's noise or range use it. All comparisons of a place of a
/// map with a reading are made within [`tolerance`](Self::tolerance).
///
/// ```
/// use dymlm_core::SensorModel;
///
/// let sensor = SensorModel { max_depth: 6.0, ..SensorModel::realsense_d4xx() };
/// assert!(sensor.validate().is_ok());
/// assert!(sensor.is_used(5.9) && !sensor.is_used(6.1) && !sensor.is_used(0.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(from = "SensorTable", deny_unknown_fields))]
pub struct SensorModel {
    /// Noise of a reading by its depth. Default: the Kinect's.
    pub noise: DepthNoise,
    /// Nearest depth that is used, metres, 0..=100. Default 0.3.
    pub min_depth: f32,
    /// Farthest depth that is used, metres, `min_depth`..=1000. Default 4.5: where a Kinect's noise passes 3
    /// cm. [`Frame::average_range_end`](crate::Frame::average_range_end) keeps surfaces there whole.
    pub max_depth: f32,
    /// Every `stride`-th pixel of every `stride`-th row is used, 1..=16; default 1. A stride of 2 makes
    /// 1280x720 as cheap as 640x360.
    pub stride: usize,
}

/// How many deviations a reading may lie from a place and still be a reading of it: 0.3 % of a place's own
/// readings lie further.
const TOLERANCE_SIGMAS: f64 = 3.0;

impl SensorModel {
    /// Structured light of the first Kinect, 0.3 to 4.5 m.
    #[must_use]
    pub const fn kinect() -> Self {
        Self { noise: DepthNoise::kinect(), min_depth: 0.3, max_depth: 4.5, stride: 1 }
    }

    /// Stereo of `RealSense` D415 to D455 at 848x480 (f = 425 px, b = 5 cm, 0.08 px of disparity), 0.3 to 4
    /// m.
    #[must_use]
    pub fn realsense_d4xx() -> Self {
        Self { noise: DepthNoise::stereo(425.0, 0.05, 0.08), min_depth: 0.3, max_depth: 4.0, stride: 1 }
    }

    /// Time of flight (Azure Kinect, Kinect 2, phones' depth cameras): 8 mm at every depth, 0.3 to 5 m.
    #[must_use]
    pub const fn time_of_flight() -> Self {
        Self { noise: DepthNoise::constant(0.008), min_depth: 0.3, max_depth: 5.0, stride: 1 }
    }

    /// Standard deviation of a reading at depth `z`, metres.
    #[inline]
    #[must_use]
    pub fn sigma(&self, z: f32) -> f32 {
        self.noise.sigma(z)
    }

    /// Whether a depth is a reading (above 0) and lies within the range that is used.
    #[inline]
    #[must_use]
    pub fn is_used(&self, z: f32) -> bool {
        z > 0.0 && z >= self.min_depth && z <= self.max_depth
    }

    /// How far a reading of a place at depth `z` may lie from it, metres: three deviations of the reading's
    /// noise and the place's own uncertainty `place_sigma` (how well the map, the pose or the model know
    /// where it is), which are independent.
    #[inline]
    #[must_use]
    pub fn tolerance(&self, z: f32, place_sigma: f64) -> f64 {
        let sigma = f64::from(self.sigma(z));
        // Not hypot: nothing here is near the limits of f64, and this is called for each block of the
        // evidence.
        TOLERANCE_SIGMAS * (sigma * sigma + place_sigma * place_sigma).sqrt()
    }

    /// Checks every field.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] names the first field outside its range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        self.noise.validate()?;
        check_range("sensor.min_depth", self.min_depth.into(), 0.0..=100.0)?;
        check_range("sensor.max_depth", self.max_depth.into(), f64::from(self.min_depth).max(0.1)..=1000.0)?;
        check_range("sensor.stride", self.stride as f64, 1.0..=16.0)
    }
}

impl Default for SensorModel {
    fn default() -> Self {
        Self::kinect()
    }
}

/// The sensors that a config file may name.
#[cfg(feature = "serde")]
#[derive(Debug, Clone, Copy, Default, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
enum Preset {
    #[default]
    Kinect,
    RealsenseD4xx,
    TimeOfFlight,
}

/// A sensor in a config file: a preset, and single fields that replace the preset's.
#[cfg(feature = "serde")]
#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
struct SensorTable {
    preset: Preset,
    noise: Option<DepthNoise>,
    min_depth: Option<f32>,
    max_depth: Option<f32>,
    stride: Option<usize>,
}

#[cfg(feature = "serde")]
impl From<SensorTable> for SensorModel {
    fn from(table: SensorTable) -> Self {
        let preset = match table.preset {
            Preset::Kinect => Self::kinect(),
            Preset::RealsenseD4xx => Self::realsense_d4xx(),
            Preset::TimeOfFlight => Self::time_of_flight(),
        };
        Self {
            noise: table.noise.unwrap_or(preset.noise),
            min_depth: table.min_depth.unwrap_or(preset.min_depth),
            max_depth: table.max_depth.unwrap_or(preset.max_depth),
            stride: table.stride.unwrap_or(preset.stride),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_field_out_of_its_range_is_named() {
        let refused = |change: fn(&mut SensorModel)| {
            let mut sensor = SensorModel::kinect();
            change(&mut sensor);
            sensor.validate().unwrap_err().field
        };
        assert_eq!(refused(|sensor| sensor.noise.floor = 0.0), "sensor.noise.floor");
        // The bound itself, in single precision.
        let noise = DepthNoise { floor: 1e-5, ..DepthNoise::constant(0.01) };
        assert!(SensorModel { noise, ..SensorModel::kinect() }.validate().is_ok());
        assert_eq!(refused(|sensor| sensor.noise.growth = f32::NAN), "sensor.noise.growth");
        assert_eq!(refused(|sensor| sensor.min_depth = -1.0), "sensor.min_depth");
        assert_eq!(refused(|sensor| sensor.max_depth = 0.2), "sensor.max_depth");
        assert_eq!(refused(|sensor| sensor.stride = 0), "sensor.stride");
    }

    #[test]
    fn the_tolerance_combines_independent_errors() {
        let sensor = SensorModel { noise: DepthNoise::constant(0.03), ..SensorModel::kinect() };
        assert!((sensor.tolerance(1.0, 0.04) - 0.15).abs() < 1e-6);
        assert!((sensor.tolerance(1.0, 0.0) - 0.09).abs() < 1e-6);
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_file_names_a_preset_and_single_fields_over_it() {
        let sensor: SensorModel =
            serde_json::from_str(r#"{"preset": "realsense_d4xx", "max_depth": 6.0}"#).unwrap();
        assert_eq!(sensor, SensorModel { max_depth: 6.0, ..SensorModel::realsense_d4xx() });
        let written = serde_json::to_string(&sensor).unwrap();
        assert_eq!(serde_json::from_str::<SensorModel>(&written).unwrap(), sensor);
        assert!(serde_json::from_str::<SensorModel>(r#"{"preset": "kinect2"}"#).is_err());
        assert!(serde_json::from_str::<SensorModel>(r#"{"max_range": 3.0}"#).is_err());
    }
}

use crate::{ConfigError, check_range};

/// Standard deviation of a depth reading along the optical axis, as a function of its depth: sigma(z) =
/// `floor` + `growth` max(z - `start`, 0)^2, metres.
///
/// The one formula holds for the three kinds of depth camera, and has no branch, so that it runs over whole
/// images: structured light ([`kinect`](Self::kinect)), [`stereo`](Self::stereo), and
/// [`constant`](Self::constant) for time of flight and lidar.
///
/// ```
/// use dymlm_core::DepthNoise;
///
/// assert_eq!(DepthNoise::kinect().sigma(0.4), 0.0012);
/// assert!((DepthNoise::kinect().sigma(2.4) - 0.0088).abs() < 1e-6);
/// assert_eq!(DepthNoise::constant(0.008).sigma(5.0), 0.008);
/// // A RealSense D435 at 848x480: 1.5 cm at 2 m and 6 cm at 4 m.
/// let stereo = DepthNoise::stereo(425.0, 0.05, 0.08);
/// assert!((stereo.sigma(2.0) - 0.0161).abs() < 1e-4 && (stereo.sigma(4.0) - 0.0612).abs() < 1e-4);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct DepthNoise {
    /// Noise up to the depth `start`, metres, 1e-5..=1.
    pub floor: f32,
    /// Growth with the square of the depth beyond `start`, 1/m, 0..=1.
    pub growth: f32,
    /// Depth at which the noise begins to grow, metres, 0..=100.
    pub start: f32,
}

impl DepthNoise {
    /// Structured light of the first Kinect: 0.0012 + 0.0019 (z - 0.4)^2.
    ///
    /// Nguyen, Izadi, Lovell: "Modeling Kinect Sensor Noise for Improved 3D Reconstruction and Tracking",
    /// 3DIMPVT 2012. Measured for 0.4 to 3 m and incidence below 60 degrees; nearer readings are taken as
    /// those at 0.4 m.
    #[must_use]
    pub const fn kinect() -> Self {
        Self { floor: 0.0012, growth: 0.0019, start: 0.4 }
    }

    /// A stereo pair: `z^2 sigma_d / (f b)`, and 1 mm of quantization.
    ///
    /// `focal_length` f in pixels of the image in which disparities are measured, `baseline` b in metres,
    /// `disparity_sigma` (`sigma_d`) in pixels.
    #[must_use]
    pub fn stereo(focal_length: f64, baseline: f64, disparity_sigma: f64) -> Self {
        Self { floor: 0.001, growth: (disparity_sigma / (focal_length * baseline)) as f32, start: 0.0 }
    }

    /// The same noise at every depth, metres: time of flight, lidar.
    #[must_use]
    pub const fn constant(sigma: f32) -> Self {
        Self { floor: sigma, growth: 0.0, start: 0.0 }
    }

    /// Standard deviation of a reading at depth `z`, metres.
    #[inline]
    #[must_use]
    pub fn sigma(&self, z: f32) -> f32 {
        let beyond = (z - self.start).max(0.0);
        self.floor + self.growth * beyond * beyond
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("sensor.noise.floor", self.floor.into(), 1e-5_f32.into()..=1.0)?;
        check_range("sensor.noise.growth", self.growth.into(), 0.0..=1.0)?;
        check_range("sensor.noise.start", self.start.into(), 0.0..=100.0)
    }
}

impl Default for DepthNoise {
    fn default() -> Self {
        Self::kinect()
    }
}

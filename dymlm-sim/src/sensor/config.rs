use dymlm_core::{ConfigError, DepthNoise, check_range};

/// The errors of a depth camera. The default is [`kinect`](Self::kinect); there are also a stereo pair
/// ([`realsense_d435`](Self::realsense_d435)), [`time_of_flight`](Self::time_of_flight), and a camera without
/// errors ([`ideal`](Self::ideal)).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SensorConfig {
    /// Nearest depth with a reading, metres, 0..=100 and at most `max_depth`, default 0.5 (Kinect for
    /// Windows, near limit in practice).
    pub min_depth: f64,
    /// Farthest depth with a reading, metres, 0..=1000, default 6.
    pub max_depth: f64,
    /// Noise along the optical axis as a function of depth; its floor and growth 0..=1, its start 0..=100 m.
    /// Default: the Kinect's.
    pub noise: DepthNoise,
    /// Factor on the noise that a steep view adds, 0..=10, default 1. The noise is 0.0001 / sqrt(z) theta^2 /
    /// (pi/2 - theta)^2 m for an angle of incidence theta above 53 degrees (Nguyen 2012).
    pub steep_noise: f64,
    /// Standard deviation of the ray's position in the image, pixels of an image 640 wide, 0..=5, default 0.8
    /// (Nguyen 2012, lateral noise, about the same at all depths).
    pub lateral_noise: f64,
    /// Depth step at 1 m, metres, 0..=0.1, default 0.00285: disparities come in steps of 1/8 px, so that with
    /// f = 585 px and a baseline of 7.5 cm the step is z^2 / 351 m, 1.1 cm at 2 m. 0 = no quantization.
    pub quantization: f64,
    /// Distance from the camera to the projector along x, metres, -1..=1, default 0.075 (Kinect). Surfaces
    /// that the projector does not light have no reading: the shadow beside near things. 0 = no shadow.
    pub baseline: f64,
    /// Distance from a depth edge within which readings are disturbed, pixels of an image 640 wide, 0..=20,
    /// default 2: the ring without depth around silhouettes.
    pub edge_width: f64,
    /// Share of the pixels near an edge that have no reading, 0..=1, default 0.6.
    pub edge_dropout: f64,
    /// Share of the pixels near an edge that read a depth between the two surfaces, 0..=1 - `edge_dropout`,
    /// default 0.03.
    pub flying_pixels: f64,
    /// Angle of incidence above which readings begin to get lost, radians, 0..=`grazing_end`, default 1.31
    /// (75 degrees).
    pub grazing_start: f64,
    /// Angle of incidence above which there is no reading, radians, 0..=pi/2, default 1.50 (86 degrees).
    pub grazing_end: f64,
    /// Share of readings that get lost on any surface, 0..=1, default 0.002.
    pub dropout: f64,
    /// Factor on the share of readings that get lost on dark and shiny surfaces (screens), 0..=1, default 1.
    pub absorption: f64,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self::kinect()
    }
}

impl SensorConfig {
    /// The structured light of the first Kinect.
    #[must_use]
    pub const fn kinect() -> Self {
        Self {
            min_depth: 0.5,
            max_depth: 6.0,
            noise: DepthNoise::kinect(),
            steep_noise: 1.0,
            lateral_noise: 0.8,
            quantization: 0.002_85,
            baseline: 0.075,
            edge_width: 2.0,
            edge_dropout: 0.6,
            flying_pixels: 0.03,
            grazing_start: 1.31,
            grazing_end: 1.50,
            dropout: 0.002,
            absorption: 1.0,
        }
    }

    /// The stereo pair of a `RealSense` D435 at 848x480 (f = 425 px, baseline 5 cm, 0.08 px of disparity,
    /// steps of 1/32 px), with the noise of
    /// [`SensorModel::realsense_d4xx`](dymlm_core::SensorModel::realsense_d4xx). Edges disturb readings
    /// farther away than with structured light (the matching window), and more of the pixels there read a
    /// depth between the surfaces.
    #[must_use]
    pub fn realsense_d435() -> Self {
        Self {
            min_depth: 0.3,
            noise: DepthNoise::stereo(425.0, 0.05, 0.08),
            lateral_noise: 0.5,
            quantization: 1.0 / (32.0 * 425.0 * 0.05),
            baseline: 0.05,
            edge_width: 3.0,
            edge_dropout: 0.4,
            flying_pixels: 0.1,
            ..Self::kinect()
        }
    }

    /// A time-of-flight camera, with the noise of
    /// [`SensorModel::time_of_flight`](dymlm_core::SensorModel::time_of_flight): no shadow, no disparity
    /// steps, and many readings between the surfaces at edges.
    #[must_use]
    pub const fn time_of_flight() -> Self {
        Self {
            min_depth: 0.3,
            noise: DepthNoise::constant(0.008),
            lateral_noise: 0.5,
            quantization: 0.0,
            baseline: 0.0,
            edge_dropout: 0.4,
            flying_pixels: 0.2,
            ..Self::kinect()
        }
    }

    /// A camera with exact depth within its range.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            noise: DepthNoise::constant(0.0),
            steep_noise: 0.0,
            lateral_noise: 0.0,
            quantization: 0.0,
            baseline: 0.0,
            edge_width: 0.0,
            edge_dropout: 0.0,
            flying_pixels: 0.0,
            grazing_start: std::f64::consts::FRAC_PI_2,
            grazing_end: std::f64::consts::FRAC_PI_2,
            dropout: 0.0,
            absorption: 0.0,
            ..Self::default()
        }
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        let right_angle = std::f64::consts::FRAC_PI_2;
        check_range("sensor.max_depth", self.max_depth, 0.0..=1000.0)?;
        check_range("sensor.min_depth", self.min_depth, 0.0..=self.max_depth.min(100.0))?;
        check_range("sensor.noise.floor", self.noise.floor.into(), 0.0..=1.0)?;
        check_range("sensor.noise.growth", self.noise.growth.into(), 0.0..=1.0)?;
        check_range("sensor.noise.start", self.noise.start.into(), 0.0..=100.0)?;
        check_range("sensor.steep_noise", self.steep_noise, 0.0..=10.0)?;
        check_range("sensor.lateral_noise", self.lateral_noise, 0.0..=5.0)?;
        check_range("sensor.quantization", self.quantization, 0.0..=0.1)?;
        check_range("sensor.baseline", self.baseline, -1.0..=1.0)?;
        check_range("sensor.edge_width", self.edge_width, 0.0..=20.0)?;
        check_range("sensor.edge_dropout", self.edge_dropout, 0.0..=1.0)?;
        // 0.9 and 0.1 are one, though 1 - 0.9 is less than 0.1.
        let are_too_many = self.edge_dropout + self.flying_pixels > 1.0;
        let most = if are_too_many { 1.0 - self.edge_dropout } else { 1.0 };
        check_range("sensor.flying_pixels", self.flying_pixels, 0.0..=most)?;
        check_range("sensor.grazing_end", self.grazing_end, 0.0..=right_angle)?;
        check_range("sensor.grazing_start", self.grazing_start, 0.0..=self.grazing_end)?;
        check_range("sensor.dropout", self.dropout, 0.0..=1.0)?;
        check_range("sensor.absorption", self.absorption, 0.0..=1.0)
    }
}

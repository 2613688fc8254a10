use dymlm_core::{ConfigError, check_range};

/// How a structured-light depth camera errs. The defaults are those of a first-generation Kinect.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SensorConfig {
    /// Nearest depth with a reading, metres, 0..=100, default 0.5 (Kinect for Windows, near limit in practice).
    pub min_depth: f64,
    /// Farthest depth with a reading, metres, 0..=1000, default 6.
    pub max_depth: f64,
    /// Factor on the axial noise of [`dymlm_core::axial_noise`], 0..=10, default 1. Steep views get the
    /// additional term 0.0001 / sqrt(z) theta^2 / (pi/2 - theta)^2 of the same source (Nguyen 2012).
    pub axial_noise: f64,
    /// Standard deviation of the ray's place in the image, pixels, 0..=5, default 0.8 (Nguyen 2012, lateral
    /// noise, about the same at all depths).
    pub lateral_noise: f64,
    /// Depth step at 1 m, metres, 0..=0.1, default 0.00285: disparities come in steps of 1/8 px, so that with
    /// f = 585 px and a baseline of 7.5 cm the step is z^2 / 351 m, 1.1 cm at 2 m. 0 = no quantization.
    pub quantization: f64,
    /// Distance from the camera to the projector along x, metres, -1..=1, default 0.075 (Kinect). Surfaces that
    /// the projector does not reach have no reading: the shadow beside near things. 0 = no shadow.
    pub baseline: f64,
    /// Distance over which a depth edge is felt, pixels of an image 640 wide, 0..=20, default 2: the ring without
    /// depth around silhouettes.
    pub edge_width: f64,
    /// Share of the pixels near an edge that have no reading, 0..=1, default 0.6.
    pub edge_dropout: f64,
    /// Share of the pixels near an edge that read a depth between the two surfaces, 0..=1, default 0.03.
    pub flying_pixels: f64,
    /// Incidence from which on readings get lost, radians, 0..=pi/2, default 1.31 (75 degrees).
    pub grazing_start: f64,
    /// Incidence from which on there is no reading, radians, 0..=pi/2, default 1.50 (86 degrees).
    pub grazing_end: f64,
    /// Share of pixels that get lost anywhere, 0..=1, default 0.002.
    pub dropout: f64,
    /// Factor on the share of pixels that dark and shiny surfaces (screens) swallow, 0..=1, default 1.
    pub absorption: f64,
}

impl Default for SensorConfig {
    fn default() -> Self {
        Self {
            min_depth: 0.5,
            max_depth: 6.0,
            axial_noise: 1.0,
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
}

impl SensorConfig {
    /// A camera that errs in nothing but its range: depth is exact.
    #[must_use]
    pub fn ideal() -> Self {
        Self {
            axial_noise: 0.0,
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
        check_range("sensor.axial_noise", self.axial_noise, 0.0..=10.0)?;
        check_range("sensor.lateral_noise", self.lateral_noise, 0.0..=5.0)?;
        check_range("sensor.quantization", self.quantization, 0.0..=0.1)?;
        check_range("sensor.baseline", self.baseline, -1.0..=1.0)?;
        check_range("sensor.edge_width", self.edge_width, 0.0..=20.0)?;
        check_range("sensor.edge_dropout", self.edge_dropout, 0.0..=1.0)?;
        check_range("sensor.flying_pixels", self.flying_pixels, 0.0..=1.0 - self.edge_dropout)?;
        check_range("sensor.grazing_end", self.grazing_end, 0.0..=right_angle)?;
        check_range("sensor.grazing_start", self.grazing_start, 0.0..=self.grazing_end)?;
        check_range("sensor.dropout", self.dropout, 0.0..=1.0)?;
        check_range("sensor.absorption", self.absorption, 0.0..=1.0)
    }
}

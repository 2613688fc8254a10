use dymlm_core::{ConfigError, SensorModel, check_range};

/// Settings of a [`CloudMap`](crate::CloudMap).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CloudMapConfig {
    /// Side of a voxel, metres, 0.001..=1, and at least 1/8000 of the sensor's farthest depth. Default 0.01:
    /// about the spacing of a Kinect's pixels at 4 m.
    #[doc(alias = "resolution")]
    pub voxel_size: f64,
    /// Late ghost removal: number of frames looking through a place that one frame reading a surface there
    /// outweighs, 0.1..=100. Default 2.5: at the rim of a thing every other frame looks past it. In a kitchen
    /// with two people 2 loses 0.3 % more of the room, 3 leaves twice as much of the people.
    pub looks_per_reading: f64,
    /// Fewest frames that must have read a static voxel, 1..=1000000. Default 2: what a single frame has seen
    /// may be a flying pixel.
    pub min_observations: u32,
    /// Thinning: how far a static voxel looks for heavier ones, whose noise it may be, in standard deviations
    /// of its own readings, 0..=10; at most eight voxels; 0 = no thinning, and no fusing. Default 3, as the
    /// sensor's tolerance: 99.7 % of the readings of a surface are within it. In simulated rooms 2 leaves
    /// 0.93 % stray points instead of 0.26 %, and in a kitchen 0.05 % more of the room.
    pub thinning_radius: f64,
    /// Whether the points of the static cloud are moved onto the surfaces that their voxels are readings of,
    /// as one layer, where the sensor's noise is larger than a voxel. Default true. Without fusing, a far
    /// wall is a shell of points some 1.4 standard deviations thick.
    pub fuse_surfaces: bool,
}

impl Default for CloudMapConfig {
    fn default() -> Self {
        Self {
            voxel_size: 0.01,
            looks_per_reading: 2.5,
            min_observations: 2,
            thinning_radius: 3.0,
            fuse_surfaces: true,
        }
    }
}

impl CloudMapConfig {
    pub(crate) fn validate(&self, sensor: &SensorModel) -> Result<(), ConfigError> {
        check_range("cloud.voxel_size", self.voxel_size, 0.001..=1.0)?;
        check_range("sensor.max_depth", sensor.max_depth.into(), 0.0..=8000.0 * self.voxel_size)?;
        check_range("cloud.looks_per_reading", self.looks_per_reading, 0.1..=100.0)?;
        check_range("cloud.min_observations", self.min_observations.into(), 1.0..=1e6)?;
        check_range("cloud.thinning_radius", self.thinning_radius, 0.0..=10.0)
    }
}

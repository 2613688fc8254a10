use dymlm_core::{ConfigError, SensorModel, check_range};

/// Settings of a [`CloudMap`](crate::CloudMap).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CloudMapConfig {
    /// Side of a voxel, metres, 0.001..=1, and at least 1/8000 of the sensor's farthest depth. Default 0.01: about the
    /// spacing of a Kinect's pixels at 4 m.
    pub voxel_size: f64,
    /// Late ghost removal.
    pub evidence: EvidenceConfig,
    /// Thinning of noise on output.
    pub thinning: ThinningConfig,
}

impl Default for CloudMapConfig {
    fn default() -> Self {
        Self { voxel_size: 0.01, evidence: EvidenceConfig::default(), thinning: ThinningConfig::default() }
    }
}

/// Settings of late ghost removal: which frames speak for a place being static, and which against.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct EvidenceConfig {
    /// Side of an evidence cell, metres, 0.005..=0.5; rounded to the nearest power of two of voxels, at least one.
    /// Default 0.04. A reading looks through a cell when it lies beyond it by more than the
    /// [tolerance](SensorModel::tolerance) of a place known to half the cell's diagonal.
    pub cell_size: f64,
    /// How many frames that look through a place one frame that reads it outweighs, 0.1..=100. Default 2.5: at the rim
    /// of a thing every other look passes by it. On a kitchen with two people 2 loses 0.3 % more of the room, 3
    /// leaves twice as much of the people.
    pub looks_per_reading: f64,
}

impl Default for EvidenceConfig {
    fn default() -> Self {
        Self { cell_size: 0.04, looks_per_reading: 2.5 }
    }
}

/// Settings of thinning: which voxels of the static map are but the noise of a surface beside them.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ThinningConfig {
    /// Fewest frames that must have read a voxel, 1..=1000000. Default 2: what one frame alone has seen may be a
    /// flying pixel.
    pub min_observations: u32,
    /// How far a voxel looks for heavier ones, in standard deviations of its own readings, 0..=10; at most six
    /// voxels; 0 = no thinning. Default 2: within it lies 95 % of what was read of the same surface.
    pub radius: f64,
    /// A voxel with less than this share of the weight of one within that radius is noise, 0..=1. Default 0.4: what
    /// lies 1.4 standard deviations off a surface has that share of readings.
    pub min_weight_share: f64,
}

impl Default for ThinningConfig {
    fn default() -> Self {
        Self { min_observations: 2, radius: 2.0, min_weight_share: 0.4 }
    }
}

impl CloudMapConfig {
    pub(crate) fn validate(&self, sensor: &SensorModel) -> Result<(), ConfigError> {
        check_range("cloud.voxel_size", self.voxel_size, 0.001..=1.0)?;
        check_range("sensor.max_depth", sensor.max_depth.into(), 0.0..=8000.0 * self.voxel_size)?;
        check_range("cloud.evidence.cell_size", self.evidence.cell_size, 0.005..=0.5)?;
        check_range("cloud.evidence.looks_per_reading", self.evidence.looks_per_reading, 0.1..=100.0)?;
        let thinning = &self.thinning;
        check_range("cloud.thinning.min_observations", f64::from(thinning.min_observations), 1.0..=1e6)?;
        check_range("cloud.thinning.radius", thinning.radius, 0.0..=10.0)?;
        check_range("cloud.thinning.min_weight_share", thinning.min_weight_share, 0.0..=1.0)
    }
}

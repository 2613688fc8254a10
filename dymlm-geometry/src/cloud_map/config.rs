use dymlm_core::{ConfigError, check_range};

/// Settings of a [`CloudMap`](super::CloudMap).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CloudMapConfig {
    /// Side of a voxel, metres, 0.001..=1. Default 0.01: about the spacing of a Kinect's pixels at 4 m.
    pub voxel_size: f64,
    /// Nearest depth that is mapped, metres, 0..=100. Default 0.3: below it structured light reads nothing.
    pub min_depth: f64,
    /// Farthest depth that is mapped, metres, 0.1..=100. Default 4: there a Kinect's axial noise is 2.6 cm, and it
    /// grows with the square.
    pub max_depth: f64,
    /// Late ghost removal.
    pub evidence: EvidenceConfig,
}

impl Default for CloudMapConfig {
    fn default() -> Self {
        Self { voxel_size: 0.01, min_depth: 0.3, max_depth: 4.0, evidence: EvidenceConfig::default() }
    }
}

/// Settings of late ghost removal: which frames speak for a place being static, and which against.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct EvidenceConfig {
    /// Side of an evidence cell, metres, 0.005..=0.5; rounded to the nearest power of two of voxels. Default 0.04.
    pub cell_size: f64,
    /// A reading looks through a cell when it lies beyond it by more than this, metres, 0..=1. Default 0.06
    /// (DESIGN 4.2): the cell's half diagonal and a Kinect's noise in the middle of its range.
    pub margin: f64,
    /// ... plus this share of the depth, 0..=1. Default 0.02 (DESIGN 4.2).
    pub margin_per_depth: f64,
    /// How many frames that look through a place one frame that reads it outweighs, 0.1..=100. Default 2.5: at the rim
    /// of a thing every other look passes by it. On a kitchen with two people 2 loses 0.3 % more of the room, 3
    /// leaves twice as much of the people.
    pub looks_per_reading: f64,
}

impl Default for EvidenceConfig {
    fn default() -> Self {
        Self { cell_size: 0.04, margin: 0.06, margin_per_depth: 0.02, looks_per_reading: 2.5 }
    }
}

impl CloudMapConfig {
    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("cloud.voxel_size", self.voxel_size, 0.001..=1.0)?;
        check_range("cloud.min_depth", self.min_depth, 0.0..=100.0)?;
        check_range("cloud.max_depth", self.max_depth, self.min_depth.max(0.1)..=100.0)?;
        check_range("cloud.evidence.cell_size", self.evidence.cell_size, 0.005..=0.5)?;
        check_range("cloud.evidence.margin", self.evidence.margin, 0.0..=1.0)?;
        check_range("cloud.evidence.margin_per_depth", self.evidence.margin_per_depth, 0.0..=1.0)?;
        check_range("cloud.evidence.looks_per_reading", self.evidence.looks_per_reading, 0.1..=100.0)
    }
}

use crate::detector::PlaneDetectorConfig;
use crate::plane_map::PlaneMapConfig;

/// Settings of the whole plane step, from the depth image to the map.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct PlaneConfig {
    /// Detection of planes in a single frame.
    pub detector: PlaneDetectorConfig,
    /// The map: association, fusion, merging.
    pub map: PlaneMapConfig,
}

use crate::extraction::ExtractionConfig;
use crate::filter::FilterConfig;
use crate::plane_map::PlaneMapConfig;
use crate::refinement::RefinementConfig;

/// Settings of the whole plane step, from the depth image to the map.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct PlaneConfig {
    /// Extraction from the depth image.
    pub extraction: ExtractionConfig,
    /// The robust refit.
    pub refinement: RefinementConfig,
    /// Which planes reach the map.
    pub filter: FilterConfig,
    /// The map: association, fusion, merging.
    pub map: PlaneMapConfig,
}

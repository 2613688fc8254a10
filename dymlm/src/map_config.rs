use dymlm_cloud::CloudMapConfig;
use dymlm_core::SensorModel;
use dymlm_dynamics::DynamicsConfig;
use dymlm_objects::ObjectConfig;
use dymlm_octree::OctreeConfig;
use dymlm_planes::PlaneConfig;

use crate::KeyFrameConfig;

/// Settings of a [`MapBuilder`](crate::MapBuilder), one part a crate. Validated once, in
/// [`MapBuilder::new`](crate::MapBuilder::new).
///
/// ```
/// let mut config = dymlm::MapConfig::default();
/// config.cloud.voxel_size = 0.02;
/// config.octree.max_range = 8.0;
/// assert!(dymlm::MapBuilder::new(config.clone()).is_ok());
///
/// config.cloud.voxel_size = -1.0;
/// let error = dymlm::MapBuilder::new(config).unwrap_err();
/// assert_eq!(error.to_string(), "cloud.voxel_size = -1 is outside its range 0.001..=1");
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MapConfig {
    /// The depth camera: noise and range of what all maps read.
    pub sensor: SensorModel,
    /// Which frames are mapped.
    pub key_frames: KeyFrameConfig,
    /// Preprocessing: tracking, compensation, box correction, static mask.
    pub dynamics: DynamicsConfig,
    /// The dense cloud and late ghost removal.
    pub cloud: CloudMapConfig,
    /// The occupancy octree.
    pub octree: OctreeConfig,
    /// Planes: extraction, refinement, filter, and their map.
    pub planes: PlaneConfig,
    /// Objects: parameterization, association, update.
    pub objects: ObjectConfig,
}

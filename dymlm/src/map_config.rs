use dymlm_cloud::CloudMapConfig;
use dymlm_core::{ConfigError, SensorModel, check_range};
use dymlm_dynamics::DynamicsConfig;
use dymlm_history::HistoryConfig;
use dymlm_objects::ObjectConfig;
use dymlm_octree::OctreeConfig;
use dymlm_planes::PlaneConfig;

use crate::{KeyFrameConfig, MemoryConfig};

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
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MapConfig {
    /// The depth camera: noise and range of what all maps read.
    pub sensor: SensorModel,
    /// How long a frame waits for its detections at most, seconds between it and the newest frame, 0..=60.
    /// Default 0.5: a detector that takes longer is better reported as not run. Memory holds the frames of
    /// that time. Unless this is 0, the frame that follows immediately never ends the wait, however late it
    /// is.
    pub max_detection_delay: f64,
    /// Which frames are mapped.
    pub key_frames: KeyFrameConfig,
    /// How often the maps are published to [readers](crate::MapReader), seconds of the frames' clock, 0..=60.
    /// Default 0.5: more often costs more copies of what each frame changes, less often gives readers older
    /// maps.
    pub publish_interval: f64,
    /// Where the observations of key frames are kept, so that the maps can
    /// [follow](crate::MapBuilder::correct_poses) when poses are corrected. Default none: it takes some 65 kB
    /// a key frame of 640x480.
    pub history: HistoryConfig,
    /// How much memory the maps may take.
    pub memory: MemoryConfig,
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

impl Default for MapConfig {
    fn default() -> Self {
        Self {
            sensor: SensorModel::default(),
            max_detection_delay: 0.5,
            key_frames: KeyFrameConfig::default(),
            publish_interval: 0.5,
            history: HistoryConfig::default(),
            memory: MemoryConfig::default(),
            dynamics: DynamicsConfig::default(),
            cloud: CloudMapConfig::default(),
            octree: OctreeConfig::default(),
            planes: PlaneConfig::default(),
            objects: ObjectConfig::default(),
        }
    }
}

impl MapConfig {
    /// For recordings that are mapped after the fact: the defaults, but every frame is mapped.
    #[must_use]
    pub fn offline() -> Self {
        Self { key_frames: KeyFrameConfig::every_frame(), ..Self::default() }
    }

    /// For a robot that maps while it drives: a key frame every 5 cm, 3 degrees or 0.2 s, cloud voxels of 2
    /// cm: half of the processor time of each key frame, and nothing but tracking between them.
    #[must_use]
    pub fn robot() -> Self {
        let key_frames = KeyFrameConfig {
            min_translation: 0.05,
            min_rotation: 3_f64.to_radians(),
            ..KeyFrameConfig::default()
        };
        let mut config = Self { key_frames, ..Self::default() };
        config.cloud.voxel_size = 0.02;
        config
    }

    /// Checks that the paths can be saved with the maps: otherwise that would be found out after hours of mapping.
    #[cfg(feature = "io")]
    pub(crate) fn check_paths(&self) -> Result<(), crate::Error> {
        let history = if let HistoryConfig::Folder(path) = &self.history { Some(path) } else { None };
        let paths = [("history.folder", history), ("memory.path", self.memory.path.as_ref())];
        for (field, path) in paths.into_iter().filter_map(|(field, path)| Some((field, path?))) {
            if path.to_str().is_none() {
                return Err(crate::Error::PathNotUtf8 { field, path: path.clone() });
            }
        }
        Ok(())
    }

    /// Checks the sensor, and the fields that belong to no part.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        self.sensor.validate()?;
        check_range("max_detection_delay", self.max_detection_delay, 0.0..=60.0)?;
        check_range("publish_interval", self.publish_interval, 0.0..=60.0)
    }
}

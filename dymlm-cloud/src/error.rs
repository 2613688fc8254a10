use dymlm_core::ConfigError;

/// Why a [`CloudMap`](crate::CloudMap) refused a call. The map stays as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A saved map is damaged.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
    /// A field of the config outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A mask of another size than the frame.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A camera so far from the world's origin, or with readings so far away, that these leave the lattice.
    #[error(
        "a camera at {translation:?} m whose readings lie up to {farthest} m away: with voxels of {voxel_size} m the map \
        reaches {reach} m from the origin (sensor.max_depth and a narrower view limit how far readings lie, \
        cloud.voxel_size how far the map reaches)"
    )]
    OutOfReach {
        /// The camera's place in the world, metres.
        translation: [f64; 3],
        /// Greatest distance of a reading from the camera, metres: the sensor's greatest depth at the corner of
        /// the image.
        farthest: f64,
        /// Side of a voxel, metres.
        voxel_size: f64,
        /// Half side of the mappable cube, metres.
        reach: f64,
    },
    /// A frame that looks through too much space: its evidence would fill the memory.
    #[error(
        "a frame that looks through {volume:.0} m3: with voxels of {voxel_size} m at most {most:.0} m3 are noted a frame \
        (focal lengths are in pixels; sensor.max_depth limits how far readings lie)"
    )]
    ViewTooLarge {
        /// The space between the camera and its readings, m³.
        volume: f64,
        /// The most that a frame may look through, m³.
        most: f64,
        /// Side of a voxel, metres.
        voxel_size: f64,
    },
    /// A frame to be removed was never inserted with this pose and these masks.
    #[error("the frame at {timestamp} s is not in the map with this pose and mask: it cannot be taken out")]
    NotInserted {
        /// The frame's time, seconds.
        timestamp: f64,
    },
    /// Two maps with different configs.
    #[error("the maps have different configs: they have no common lattice")]
    DifferentConfigs,
}

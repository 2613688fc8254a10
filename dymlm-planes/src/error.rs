use dymlm_core::{ConfigError, FrameId};

/// Why a frame, a key frame or a config was refused. A refused call changes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A field of the config or of the sensor outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A saved map is damaged.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
    /// An image or a mask has another size than the camera.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A plane is so far from the world's origin that it cannot be summed exactly.
    #[error("a plane at {centroid:?} m: the map reaches {reach} m from the world's origin")]
    OutOfReach {
        /// The plane's centroid in the world, metres.
        centroid: [f64; 3],
        /// Half side of the mappable cube, metres.
        reach: f64,
    },
    /// A key frame that was to be removed is not in the map.
    #[error("key frame {key_frame} is not in the map: it cannot be removed")]
    UnknownKeyFrame {
        /// The given id.
        key_frame: FrameId,
    },
}

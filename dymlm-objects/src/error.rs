use dymlm_core::ConfigError;

/// Why a frame or a config was refused. A refused frame changes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A saved map is damaged.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
    /// A frame older than the one before it.
    #[error("a frame of time {timestamp} s after one of time {previous} s: time must not go backwards")]
    TimeReversed {
        /// Time of the frame before, seconds.
        previous: f64,
        /// Time of the refused frame, seconds.
        timestamp: f64,
    },
    /// A pose beyond the reach of the map.
    #[error("the camera at {position:?} m: each coordinate must be within {reach} m of the origin")]
    OutOfReach {
        /// Where the camera is, metres.
        position: [f64; 3],
        /// Greatest magnitude of a coordinate, metres.
        reach: f64,
    },
    /// A value that `dymlm-core` refuses.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A field of a config outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

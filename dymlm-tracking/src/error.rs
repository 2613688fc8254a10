use dymlm_core::ConfigError;

/// Why an input or a config was refused. A refused input changes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The part of a target on the image is too small to be told from its surroundings.
    #[error(
        "a target of {visible_width}x{visible_height} pixels on the image: at least {least}x{least} are needed"
    )]
    TargetSize {
        /// Width of the box's part on the image, pixels.
        visible_width: f32,
        /// Height of the box's part on the image, pixels.
        visible_height: f32,
        /// Least width and height, pixels.
        least: f32,
    },
    /// A frame is older than the previous one, or its time is not finite.
    #[error("a frame of time {timestamp} s after one of time {previous} s: time must not go backwards")]
    TimeReversed {
        /// Time of the previous frame, seconds.
        previous: f64,
        /// Time of the refused frame, seconds.
        timestamp: f64,
    },
    /// An object has too few surface points to be tracked.
    #[error("an object model of {points} finite points: at least {least} are needed")]
    ModelPoints {
        /// Number of finite points.
        points: usize,
        /// Least number.
        least: usize,
    },
    /// A frame lacks the colour image that tracking needs.
    #[error("the frame has no colour image, which tracking needs")]
    NoColor,
    /// The object is not visible at its given pose when tracking starts.
    #[error("only {found} corners of the object are seen where it should be: at least {least} are needed")]
    NotSeen {
        /// Number of corners found.
        found: usize,
        /// Least number.
        least: usize,
    },
    /// A value that a type of [`dymlm_core`] refuses.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A field of a config is outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

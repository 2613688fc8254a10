use dymlm_core::ConfigError;

/// Why a frame or a config was refused. A refused frame changes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A frame older than the one before it.
    #[error("a frame of time {timestamp} s after one of time {previous} s: time must not go backwards")]
    TimeReversed {
        /// Time of the frame before, seconds.
        previous: f64,
        /// Time of the refused frame, seconds.
        timestamp: f64,
    },
    /// A timestamp that cannot be in seconds: not finite, or so large that it must be in another unit (epoch
    /// times in milliseconds, microseconds and nanoseconds are that large).
    #[error("a timestamp of {0} s: it must be finite and at most 1e11 in magnitude; is it in seconds?")]
    Timestamp(f64),
    /// A detection's instance mask has another size than the frame.
    #[error(
        "the instance mask of detection {detection} has {actual_width}x{actual_height} pixels, the frame {width}x{height}"
    )]
    InstanceMaskSize {
        /// Index of the detection.
        detection: usize,
        /// The frame's width, pixels.
        width: usize,
        /// The frame's height, pixels.
        height: usize,
        /// The mask's width, pixels.
        actual_width: usize,
        /// The mask's height, pixels.
        actual_height: usize,
    },
    /// More detections than a detector gives after non-maximum suppression.
    #[error(
        "{given} detections in one frame, more than {max}: has the detector suppressed boxes that overlap (non-maximum \
         suppression)?"
    )]
    TooManyDetections {
        /// Detections with a score of at least 0.1.
        given: usize,
        /// The allowed number.
        max: usize,
    },
    /// A mover label that is not a COCO class, perhaps a misspelt one.
    #[error(
        "dynamics.mover_labels: \"{label}\" is no class of COCO; is \"{nearest}\" meant? A detector's own classes go into \
         dynamics.own_mover_labels"
    )]
    UnknownLabel {
        /// The label.
        label: String,
        /// The COCO class with the most similar spelling.
        nearest: &'static str,
    },
    /// A value that `dymlm-core` refuses.
    #[error(transparent)]
    Core(#[from] dymlm_core::Error),
    /// A field of a config outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

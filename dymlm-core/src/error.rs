use crate::ConfigError;

/// Why a value was refused. A refused value changes nothing.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A width or height of zero, or more pixels than
    /// [`PinholeCamera::MAX_PIXELS`](crate::PinholeCamera::MAX_PIXELS).
    #[error(
        "an image of {width}x{height} pixels: both sides must be positive and their product at most 2^28"
    )]
    ImageSize {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
    },
    /// A buffer whose length is not width times height.
    #[error("a buffer of {actual} values for an image of {width}x{height} pixels, which needs {expected}")]
    BufferLength {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Needed length.
        expected: usize,
        /// Given length.
        actual: usize,
    },
    /// A foreign buffer whose rows overlap, or that ends before the last row does.
    #[error(
        "a buffer of {actual} values for {} rows of {} values, {row_stride} apart: it needs {expected}, and rows must not overlap",
        size[1], size[0]
    )]
    RowStride {
        /// Number of values in a row (of all channels), and of rows.
        size: [usize; 2],
        /// Values from the beginning of a row to that of the next.
        row_stride: usize,
        /// Needed length.
        expected: usize,
        /// Given length.
        actual: usize,
    },
    /// Two images, or an image and its camera, that should have the same size.
    #[error("{what} has {actual_width}x{actual_height} pixels, the camera {width}x{height}")]
    SizeMismatch {
        /// The image that differs.
        what: &'static str,
        /// The camera's width, pixels.
        width: usize,
        /// The camera's height, pixels.
        height: usize,
        /// The image's width, pixels.
        actual_width: usize,
        /// The image's height, pixels.
        actual_height: usize,
    },
    /// Two masks that differ in size.
    #[error("a mask of {}x{} pixels combined with one of {}x{}", other[0], other[1], size[0], size[1])]
    MaskSize {
        /// Width and height of the mask that should change, pixels.
        size: [usize; 2],
        /// Width and height of the other mask, pixels.
        other: [usize; 2],
    },
    /// Run-lengths that do not add up to the pixels of their image.
    #[error("run-lengths that add up to {sum}, an image of {width}x{height} pixels has {}", width * height)]
    RunLengths {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Their sum.
        sum: u64,
    },
    /// Clouds whose points and colours differ in number.
    #[error("{colors} colours for {points} points")]
    ColorCount {
        /// Number of points.
        points: usize,
        /// Number of colours.
        colors: usize,
    },
    /// A focal length that is zero, tiny, huge or not finite, or a principal point that is huge or not
    /// finite.
    #[error(
        "intrinsics fx = {fx}, fy = {fy}, cx = {cx}, cy = {cy}: 1e-3 <= |fx|, |fy| <= 1e9 and |cx|, |cy| <= 1e9 must hold"
    )]
    Intrinsics {
        /// Focal length along u, pixels.
        fx: f64,
        /// Focal length along v, pixels.
        fy: f64,
        /// Principal point, u.
        cx: f64,
        /// Principal point, v.
        cy: f64,
    },
    /// A number of stored units per metre that is not finite and positive.
    #[error("a depth scale of {0} units per metre: it must be finite and positive")]
    DepthScale(f64),
    /// A quaternion that is not of unit length, or a pose that is not finite.
    #[error(
        "no pose: translation {translation:?}, quaternion (x y z w) {quaternion:?} of norm {norm}: all must be finite, the norm within 0.01 of 1"
    )]
    Pose {
        /// Given translation, metres.
        translation: [f64; 3],
        /// Given quaternion, x y z w.
        quaternion: [f64; 4],
        /// Its norm.
        norm: f64,
    },
    /// A matrix that is no rotation.
    #[error("the matrix {0:?} is no rotation: rows must be orthonormal to 1e-3 and the determinant +1")]
    Rotation([[f64; 3]; 3]),
    /// A box that is not finite or ends before it begins.
    #[error("no box: [{x_min}, {x_max}) x [{y_min}, {y_max}) must be finite and min <= max")]
    BoundingBox {
        /// Left side, pixels.
        x_min: f32,
        /// Upper side, pixels.
        y_min: f32,
        /// Right side, pixels.
        x_max: f32,
        /// Lower side, pixels.
        y_max: f32,
    },
    /// A detection score outside 0 to 1.
    #[error("a detection score of {0}: it must be within 0..=1")]
    Score(f32),
    /// A plane whose normal has no direction or whose parameters are not finite.
    #[error("no plane: normal {normal:?}, d = {d}")]
    Plane {
        /// Given normal.
        normal: [f64; 3],
        /// Given offset, metres.
        d: f64,
    },
    /// A timestamp that is not finite.
    #[error("a timestamp of {0} s: it must be finite")]
    Timestamp(f64),
    /// A field of a config outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

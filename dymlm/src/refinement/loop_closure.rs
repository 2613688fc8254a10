use dymlm_core::{FrameId, Pose};

/// What a place recognition has found: how one frame was seen from another. It may be wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopClosure {
    /// The frame from which the other is seen.
    pub from: FrameId,
    /// The frame that is seen.
    pub to: FrameId,
    /// Takes points of `to`'s camera to that of `from`.
    pub from_from_to: Pose,
    /// Standard deviation of the rotation about each axis, radians.
    pub rotation_deviation: f64,
    /// Standard deviation of the translation along each axis, metres.
    pub translation_deviation: f64,
}

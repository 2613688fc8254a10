use dymlm_core::{FrameId, Pose};

use crate::Error;

/// What a place recognition has found: how one frame was seen from another. It may be wrong. Between frames
/// that have the same key frame at or before them it says nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopClosure {
    /// The frame from which the other is seen.
    pub from: FrameId,
    /// The frame that is seen.
    pub to: FrameId,
    /// Takes points of `to`'s camera to that of `from`.
    pub from_from_to: Pose,
    /// Standard deviation of the rotation about each axis, radians; positive.
    pub rotation_deviation: f64,
    /// Standard deviation of the translation along each axis, metres; positive.
    pub translation_deviation: f64,
}

impl LoopClosure {
    /// Its deviations of rotation and translation, when they have a finite weight; `place`: its own in the
    /// caller's list.
    pub(super) fn checked_deviations(&self, place: usize) -> Result<[f64; 2], Error> {
        let (rotation, translation) = (self.rotation_deviation, self.translation_deviation);
        // NaN is not positive either.
        let is_usable = |deviation: f64| deviation > 0.0 && (deviation * deviation).recip().is_finite();
        if is_usable(rotation) && is_usable(translation) {
            Ok([rotation, translation])
        } else {
            Err(Error::LoopClosureDeviations { closure: place, rotation, translation })
        }
    }
}

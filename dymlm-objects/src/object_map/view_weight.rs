use dymlm_core::vector3::{Vector3, difference, dot, unit};

/// The weight of an object's observations. Repeated observations from one direction count less and less,
/// because a robot at rest sees the same view again and again.
///
/// The first [`ENOUGH`] frames of a view count fully, the n-th about [`ENOUGH`] / n, so the weight of a view
/// grows with the logarithm of its frames.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ViewWeight {
    /// Direction from the object to the camera when the view began.
    direction: Option<Vector3>,
    frames: u32,
}

/// The weight of an observation from a new view.
pub(crate) const FULL: u32 = 1024;
/// Frames of a view that count fully. A lower value tells rims from surfaces by too few readings; a higher
/// one lets what was seen for long from one place outweigh what is seen on the way around the object
/// (`what_was_seen_from_one_place_for_long_grows`).
pub(super) const ENOUGH: u32 = 20;
/// Cosine of the angle at the object from which on views differ: 15 degrees, about as much as it takes to see
/// other sides.
pub(super) const VIEW_COSINE: f64 = 0.966;

impl ViewWeight {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.direction.iter().flatten().all(|c| c.abs() <= 1.01)
    }

    /// The weight of one more observation, from 1 to [`FULL`].
    pub(crate) fn next(&mut self, object: Vector3, camera: Vector3) -> u32 {
        let direction = unit(difference(camera, object));
        if !is_same_direction(self.direction, direction) {
            *self = Self { direction, frames: 0 };
        }
        self.frames = self.frames.saturating_add(1);
        (FULL / self.frames.div_ceil(ENOUGH).max(1)).max(1)
    }

    /// Whether one more observation would count fully.
    pub(crate) fn would_count_fully(&self, object: Vector3, camera: Vector3) -> bool {
        self.clone().next(object, camera) == FULL
    }
}

/// Whether two directions from an object are of one view.
pub(super) fn is_same_direction(own: Option<Vector3>, new: Option<Vector3>) -> bool {
    own.zip(new).is_some_and(|(own, new)| dot(own, new) >= VIEW_COSINE)
}

use dymlm_core::vector3::{Vector3, difference, dot, unit};

/// What an observation of an object counts, by what it adds to those before: a robot at rest sees one view
/// again and again.
///
/// The first frames of a view count fully, the n-th a share [`ENOUGH`] / n: all frames of one view together
/// grow as their number's logarithm.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ViewWeight {
    /// From the object to the camera, when the view began.
    direction: Option<Vector3>,
    frames: u32,
}

/// What an observation of a new view counts.
pub(crate) const FULL: u32 = 1024;
/// Frames of a view that count fully. Lower tells rims from surfaces by too few readings, higher makes what
/// was seen from one place for long outweigh what is seen on the way around it
/// (`what_was_seen_from_one_place_for_long_grows`).
const ENOUGH: u32 = 20;
/// Cosine of the angle at the object by which views differ (15 degrees, about what makes other sides
/// visible).
const VIEW_COSINE: f64 = 0.966;

impl ViewWeight {
    /// Whether its numbers are some that views can have.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.direction.iter().flatten().all(|c| c.abs() <= 1.01)
    }

    /// The weight of one more observation, from 1 to [`FULL`].
    pub(crate) fn next(&mut self, object: Vector3, camera: Vector3) -> u32 {
        let direction = unit(difference(camera, object));
        let is_same = self.direction.zip(direction).is_some_and(|(own, new)| dot(own, new) >= VIEW_COSINE);
        if !is_same {
            *self = Self { direction, frames: 0 };
        }
        self.frames = self.frames.saturating_add(1);
        (FULL / self.frames.div_ceil(ENOUGH).max(1)).max(1)
    }
}

use dymlm_core::{Detection, Frame, Mask, Pose};

use crate::ObjectError;

/// One frame as the object map takes it in.
#[derive(Debug, Clone, Copy)]
pub struct ObjectView<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) detections: &'a [Detection],
    pub(crate) world_from_camera: Pose,
    pub(crate) static_mask: Option<&'a Mask>,
    pub(crate) mover_labels: &'a [String],
    pub(crate) sighted_points: &'a [SightedPoint],
}

/// A map point of the caller's (of a SLAM front end) and where the frame shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct SightedPoint {
    /// Tells the caller's map points apart; the same in all frames.
    pub id: u64,
    /// Where it is in the image, `[u, v]` pixels.
    pub pixel: [f32; 2],
}

impl SightedPoint {
    /// A map point at a pixel.
    pub fn new(id: u64, pixel: [f32; 2]) -> Self {
        Self { id, pixel }
    }
}

impl<'a> ObjectView<'a> {
    /// A frame, what a detector found in it, and the pose that takes its camera coordinates to the world.
    pub fn new(frame: &'a Frame, detections: &'a [Detection], world_from_camera: &Pose) -> Self {
        Self {
            frame,
            detections,
            world_from_camera: *world_from_camera,
            static_mask: None,
            mover_labels: &[],
            sighted_points: &[],
        }
    }

    /// Says which pixels are static (`true`); without a mask all of them are.
    ///
    /// # Errors
    ///
    /// [`ObjectError::Core`] when the mask is of another size than the frame.
    pub fn with_static_mask(mut self, mask: &'a Mask) -> Result<Self, ObjectError> {
        self.frame.camera().check_size("the static mask", mask.width(), mask.height())?;
        self.static_mask = Some(mask);
        Ok(self)
    }

    /// Says which labels are movers: their detections are passed over.
    #[must_use]
    pub fn without_labels(mut self, mover_labels: &'a [String]) -> Self {
        self.mover_labels = mover_labels;
        self
    }

    /// Adds the caller's map points; those of two observations of one object are mostly the same.
    #[must_use]
    pub fn with_sighted_points(mut self, sighted_points: &'a [SightedPoint]) -> Self {
        self.sighted_points = sighted_points;
        self
    }

    #[inline]
    pub(crate) fn is_static(&self, u: usize, v: usize) -> bool {
        self.static_mask.is_none_or(|mask| mask.at(u, v))
    }

    pub(crate) fn is_mover(&self, detection: &Detection) -> bool {
        self.mover_labels.iter().any(|label| label == detection.label())
    }
}

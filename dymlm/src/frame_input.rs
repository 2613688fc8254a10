use dymlm_core::{Detection, Frame, Pose};
use dymlm_objects::SightedPoint;

use crate::Detections;

/// One frame as [`MapBuilder::insert_frame`](crate::MapBuilder::insert_frame) takes it in, with everything
/// that a caller may know of it.
///
/// ```
/// use dymlm::core::{Detection, Frame, Pose};
/// use dymlm::{FrameInput, objects::SightedPoint};
///
/// # fn frame(frame: &Frame, found: &[Detection], pose: &Pose) {
/// // Map points of the SLAM front end tell whether two detections show one object.
/// let sighted = [SightedPoint::new(17, [320.0, 240.0])];
/// let input = FrameInput::new(frame, found, pose).with_sighted_points(&sighted);
/// # let _ = input; }
/// ```
#[derive(Debug, Clone, Copy)]
pub struct FrameInput<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) found: Detections<'a>,
    pub(crate) world_from_camera: Pose,
    pub(crate) sighted_points: &'a [SightedPoint],
}

impl<'a> FrameInput<'a> {
    /// A frame, what the detector says of it, and the pose that takes its camera coordinates to the world.
    pub fn new(frame: &'a Frame, found: impl Into<Detections<'a>>, world_from_camera: &Pose) -> Self {
        Self { frame, found: found.into(), world_from_camera: *world_from_camera, sighted_points: &[] }
    }

    /// Adds the SLAM's map points that the frame shows, by their ids: two observations of one object mostly
    /// share such points. Without them, the voxels of the objects' clouds play their part. An id means the
    /// same point until the next session begins ([`begin_session`](crate::MapBuilder::begin_session)); of
    /// each object the 4096 that were sighted last are kept.
    #[must_use]
    pub fn with_sighted_points(mut self, sighted_points: &'a [SightedPoint]) -> Self {
        self.sighted_points = sighted_points;
        self
    }

    /// What was found; `None` when the detector did not run.
    pub(crate) fn detections(&self) -> Option<&'a [Detection]> {
        match self.found {
            Detections::Found(found) => Some(found),
            Detections::NotRun | Detections::Pending => None,
        }
    }
}

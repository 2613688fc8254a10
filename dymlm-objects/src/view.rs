use dymlm_core::{Detection, Frame, Mask, Pose};

use crate::Error;

/// Uncertainty of an object's surface beyond the noise of one reading, metres, as a standard deviation:
/// errors of poses, and of points fused from several sides. A lower value removes objects when poses drift
/// and takes a thing's own slope for an occluder, a higher one keeps low objects that are gone, because the
/// surface under them is read near their place.
pub(crate) const PLACE_SIGMA: f64 = 0.05 / 3.0;

/// The input of the object map from one frame.
#[derive(Debug, Clone, Copy)]
pub struct ObjectView<'a> {
    pub(crate) frame: &'a Frame,
    /// `None` when the detector did not run on the frame.
    detections: Option<&'a [Detection]>,
    pub(crate) world_from_camera: Pose,
    pub(crate) static_mask: Option<&'a Mask>,
    pub(crate) mover_labels: &'a [String],
    pub(crate) sighted_points: &'a [SightedPoint],
}

/// A map point of the caller's (of a SLAM front end) and where the frame shows it.
#[doc(alias = "landmark")]
#[doc(alias = "keypoint")]
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SightedPoint {
    /// The caller's id of the map point, the same in all frames.
    pub id: u64,
    /// Its place in the image, `[u, v]` pixels.
    pub pixel: [f32; 2],
}

impl SightedPoint {
    /// A map point at a pixel.
    pub fn new(id: u64, pixel: [f32; 2]) -> Self {
        Self { id, pixel }
    }
}

impl<'a> ObjectView<'a> {
    /// A frame, what a detector found in it, and the pose of its camera. An empty slice means that the
    /// detector ran and found nothing, which counts against the objects in view.
    pub fn new(frame: &'a Frame, detections: &'a [Detection], world_from_camera: &Pose) -> Self {
        Self { detections: Some(detections), ..Self::without_detector_run(frame, world_from_camera) }
    }

    /// A frame on which the detector did not run: it says nothing about objects.
    pub fn without_detector_run(frame: &'a Frame, world_from_camera: &Pose) -> Self {
        Self {
            frame,
            detections: None,
            world_from_camera: *world_from_camera,
            static_mask: None,
            mover_labels: &[],
            sighted_points: &[],
        }
    }

    /// Sets which pixels are static (`true`); without a mask all of them are.
    ///
    /// # Errors
    ///
    /// [`Error::Core`] when the mask has another size than the frame.
    pub fn with_static_mask(mut self, mask: &'a Mask) -> Result<Self, Error> {
        self.frame.camera().check_size("the static mask", mask.width(), mask.height())?;
        self.static_mask = Some(mask);
        Ok(self)
    }

    /// Sets which labels are movers: their detections are ignored.
    #[must_use]
    pub fn without_labels(mut self, mover_labels: &'a [String]) -> Self {
        self.mover_labels = mover_labels;
        self
    }

    /// Adds the caller's map points. Two observations of one object share most of the map points on it, which
    /// tells it from its neighbours; without map points, the voxels of the object's cloud are compared. When
    /// ids come to mean other points, call
    /// [`forget_sighted_points`](crate::ObjectMapper::forget_sighted_points).
    #[must_use]
    pub fn with_sighted_points(mut self, sighted_points: &'a [SightedPoint]) -> Self {
        self.sighted_points = sighted_points;
        self
    }

    pub(crate) fn has_detections(&self) -> bool {
        self.detections.is_some()
    }

    pub(crate) fn detections(&self) -> &'a [Detection] {
        self.detections.unwrap_or_default()
    }

    #[inline]
    pub(crate) fn is_static(&self, u: usize, v: usize) -> bool {
        self.static_mask.is_none_or(|mask| mask.at(u, v))
    }

    pub(crate) fn is_mover(&self, detection: &Detection) -> bool {
        self.mover_labels.iter().any(|label| label == detection.label())
    }
}

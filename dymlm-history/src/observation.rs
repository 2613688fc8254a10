use dymlm_core::{ColorImage, DepthImage, Detection, Error, Frame, Mask, PinholeCamera};
use dymlm_objects::SightedPoint;
use dymlm_planes::DetectedPlane;

use crate::ReducedColors;

/// Everything that a key frame brings into the maps, in its camera's coordinates, without its pose.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Observation {
    /// The images as they are mapped, colours [reduced](ReducedColors).
    pub frame: Frame,
    /// The stored colours, from which those of the frame are made.
    pub(crate) colors: Option<ReducedColors>,
    /// The pixels that are mapped; all at first.
    pub static_mask: Mask,
    /// The pixels that are surely a mover's; none at first.
    pub mover_mask: Mask,
    /// The pixels of things that are new in free space; none at first.
    pub unproven_mask: Mask,
    /// What the detector has found, all labels; `None`, as at first, when it did not run.
    pub detections: Option<Vec<Detection>>,
    /// The caller's map points that the frame shows.
    pub sighted_points: Vec<SightedPoint>,
    /// The planes of the depth image, camera frame.
    pub planes: Vec<DetectedPlane>,
}

impl Observation {
    /// The observation of a frame with its images alone: no movers, detections or planes. O(pixels).
    ///
    /// # Errors
    ///
    /// None is expected: a frame's images fit its camera.
    pub fn of_frame(frame: &Frame) -> Result<Self, Error> {
        let colors = frame.color().map(ReducedColors::of);
        Self::of_images(frame.timestamp(), *frame.camera(), frame.depth().clone(), colors)
    }

    /// The observation of another frame with its images alone, in the buffers of this one.
    pub(crate) fn refilled(self, frame: &Frame) -> Result<Self, Error> {
        let Self { frame: before, colors, static_mask, mover_mask, unproven_mask, .. } = self;
        let (mut depth, restored) = before.into_images();
        depth.subsample_from(frame.depth(), 1);
        let colors = frame.color().map(|image| {
            let mut colors = colors.unwrap_or_default();
            colors.refill(image);
            colors
        });
        let buffer = restored.map(ColorImage::into_data).unwrap_or_default();
        let color = colors.as_ref().map(|colors| colors.to_image_in(buffer)).transpose()?;
        let (width, height) = (frame.camera().width(), frame.camera().height());
        let refilled = |mut mask: Mask, value| mask.refill(width, height, value).map(|()| mask);
        Ok(Self {
            frame: Frame::new(frame.timestamp(), *frame.camera(), depth, color)?,
            colors,
            static_mask: refilled(static_mask, true)?,
            mover_mask: refilled(mover_mask, false)?,
            unproven_mask: refilled(unproven_mask, false)?,
            detections: None,
            sighted_points: Vec::new(),
            planes: Vec::new(),
        })
    }

    pub(crate) fn of_images(
        timestamp: f64,
        camera: PinholeCamera,
        depth: DepthImage,
        colors: Option<ReducedColors>,
    ) -> Result<Self, Error> {
        let (width, height) = (camera.width(), camera.height());
        let color = colors.as_ref().map(ReducedColors::to_image).transpose()?;
        Ok(Self {
            frame: Frame::new(timestamp, camera, depth, color)?,
            colors,
            static_mask: Mask::filled(width, height, true)?,
            mover_mask: Mask::filled(width, height, false)?,
            unproven_mask: Mask::filled(width, height, false)?,
            detections: None,
            sighted_points: Vec::new(),
            planes: Vec::new(),
        })
    }
}

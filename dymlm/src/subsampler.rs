use dymlm_core::{Detection, Frame};
use dymlm_dynamics::Mover;
use dymlm_objects::SightedPoint;

use crate::Error;

/// Takes every `stride`-th pixel of every `stride`-th row of a frame, once, before any step: no step knows of a stride.
#[derive(Debug, Clone)]
pub(crate) struct Subsampler {
    stride: usize,
    frame: Option<Frame>,
    detections: Vec<Detection>,
    sighted_points: Vec<SightedPoint>,
}

/// A frame, what was found in it, and the SLAM's map points in it, all in the pixels that are used.
pub(crate) type UsedPixels<'a> = (&'a Frame, Option<&'a [Detection]>, &'a [SightedPoint]);

impl Subsampler {
    pub(crate) fn new(stride: usize) -> Self {
        Self { stride, frame: None, detections: Vec::new(), sighted_points: Vec::new() }
    }

    /// The frame in the pixels that are used; itself when all are.
    pub(crate) fn subsample<'a>(
        &'a mut self,
        frame: &'a Frame,
        found: Option<&'a [Detection]>,
        sighted_points: &'a [SightedPoint],
    ) -> Result<UsedPixels<'a>, Error> {
        let stride = self.stride;
        if stride == 1 {
            return Ok((frame, found, sighted_points));
        }
        let smaller = match self.frame.take() {
            Some(mut smaller) => {
                frame.subsample_into(stride, &mut smaller)?;
                smaller
            }
            None => frame.subsampled(stride)?,
        };
        self.detections.clear();
        self.detections.extend(found.unwrap_or(&[]).iter().map(|detection| detection.subsampled(stride)));
        self.sighted_points.clear();
        self.sighted_points.extend(
            sighted_points
                .iter()
                .map(|point| SightedPoint::new(point.id, point.pixel.map(|c| c / stride as f32))),
        );
        Ok((self.frame.insert(smaller), found.map(|_| self.detections.as_slice()), &self.sighted_points))
    }
}

/// Movers with their boxes in the caller's pixels.
pub(crate) fn in_all_pixels(movers: &[Mover], stride: usize) -> Vec<Mover> {
    let whole = |mover: &Mover| {
        let mut mover = mover.clone();
        mover.bounding_box = mover.bounding_box.upsampled(stride);
        mover.corrected_box = mover.corrected_box.upsampled(stride);
        mover
    };
    movers.iter().map(whole).collect()
}

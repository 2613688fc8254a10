use dymlm_core::{Detection, Frame, Mask, SensorModel};
use dymlm_dynamics::Mover;
use dymlm_objects::SightedPoint;

use crate::{Error, FrameInput};

/// Takes every `stride`-th pixel of every `stride`-th row of a frame, averages the readings at the end of the
/// sensor's range, and moves the frame's time to the maps' clock: once, before any step, so that no step knows
/// of a stride or of sessions.
#[derive(Debug, Clone)]
pub(crate) struct Subsampler {
    sensor: SensorModel,
    frame: Option<Frame>,
    /// A buffer for depths.
    readings: Vec<f32>,
    detections: Vec<Detection>,
    sighted_points: Vec<SightedPoint>,
}

impl Subsampler {
    pub(crate) fn new(sensor: SensorModel) -> Self {
        Self { sensor, frame: None, readings: Vec::new(), detections: Vec::new(), sighted_points: Vec::new() }
    }

    /// The frame, its detections and its map points in the pixels that are used, with `clock_offset` seconds
    /// added to its time; the input itself when nothing changes.
    pub(crate) fn bring_in<'a>(
        &'a mut self,
        input: &FrameInput<'a>,
        clock_offset: f64,
    ) -> Result<FrameInput<'a>, Error> {
        let stride = self.sensor.stride;
        if stride == 1 && clock_offset == 0.0 && !input.frame.reaches_range_end(&self.sensor) {
            return Ok(*input);
        }
        let mut smaller = match self.frame.take() {
            Some(mut smaller) => {
                input.frame.subsample_into(stride, &mut smaller)?;
                smaller
            }
            None => input.frame.subsampled(stride)?,
        };
        smaller.set_timestamp(smaller.timestamp() + clock_offset)?;
        smaller.average_range_end(&self.sensor, &mut self.readings);
        let frame = &*self.frame.insert(smaller);
        if stride == 1 {
            return Ok(FrameInput { frame, ..*input });
        }
        let found = input.detections();
        self.detections.clear();
        self.detections.extend(found.unwrap_or(&[]).iter().map(|detection| detection.subsampled(stride)));
        let smaller_point =
            |point: &SightedPoint| SightedPoint::new(point.id, point.pixel.map(|c| c / stride as f32));
        self.sighted_points.clear();
        self.sighted_points.extend(input.sighted_points.iter().map(smaller_point));

        let found = found.map(|_| self.detections.as_slice());
        Ok(FrameInput::new(frame, found, &input.world_from_camera).with_sighted_points(&self.sighted_points))
    }
}

/// Number of the caller's pixels that a static mask leaves out.
pub(crate) fn masked_in_all_pixels(static_mask: &Mask, stride: usize) -> usize {
    (static_mask.width() * static_mask.height() - static_mask.count()) * stride * stride
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

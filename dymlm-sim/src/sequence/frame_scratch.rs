use dymlm_core::Mask;

use super::simulated_frame::SimulatedFrame;
use crate::render::Rendering;
use crate::scene::Part;
use crate::sensor::Places;

/// Buffers that a [`Sequence`](crate::Sequence) renders into: with frames handed back after use, the next
/// frame allocates no images.
///
/// ```
/// use dymlm_core::PinholeCamera;
/// use dymlm_sim::{FrameScratch, Sequence, SequenceConfig};
///
/// let mut config = SequenceConfig::default();
/// config.camera = Some(PinholeCamera::new(80, 60, 65.0, 65.0, 39.5, 29.5)?);
/// let sequence = Sequence::new(&config)?;
/// let mut scratch = FrameScratch::default();
/// for index in 0..3 {
///     let Some(frame) = sequence.frame_with(index, &mut scratch) else { break };
///     // ... use the frame, then:
///     scratch.recycle(frame);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct FrameScratch {
    pub(super) rendering: Rendering,
    pub(super) places: Places,
    pub(super) readings: Vec<f32>,
    pub(super) parts: Vec<Part>,
    pub(super) moving: Vec<Part>,
    spare_masks: Vec<Mask>,
}

impl FrameScratch {
    /// Reuses the images of a frame for the next one.
    pub fn recycle(&mut self, frame: SimulatedFrame) {
        let (depth, color) = frame.frame.into_images();
        self.readings = depth.into_data();
        self.rendering.color = color.map(dymlm_core::ColorImage::into_data).unwrap_or_default();
        self.rendering.depth = frame.true_depth.into_data();
        self.rendering.part = frame.parts;
        self.spare_masks = vec![frame.mover_mask, frame.transient_mask];
    }

    /// A mask of the given size with arbitrary contents.
    pub(super) fn take_mask(&mut self, width: usize, height: usize) -> Option<Mask> {
        let spare = self.spare_masks.pop();
        let fits = spare.filter(|mask| (mask.width(), mask.height()) == (width, height));
        fits.or_else(|| Mask::filled(width, height, false).ok())
    }
}

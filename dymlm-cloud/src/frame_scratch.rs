use crate::block_sums::BlockSums;
use crate::fixed_point::PixelRow;
use crate::frame_readings::FrameReadings;

/// What a map needs while it takes in a frame or scan; its memory is kept for the next one.
#[derive(Debug, Default)]
pub(crate) struct FrameScratch {
    /// One row of pixels, or the scan's points.
    pub(crate) row: PixelRow,
    /// (u - cx) / fx of each column.
    pub(crate) ray_x: Vec<f32>,
    /// The readings of the frame.
    pub(crate) readings: FrameReadings,
    /// Those in one block.
    pub(crate) sums: BlockSums,
}

impl FrameScratch {
    /// Bytes that it owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.row.memory_bytes()
            + self.ray_x.capacity() * size_of::<f32>()
            + self.readings.memory_bytes()
            + self.sums.memory_bytes()
    }
}

/// A clone begins empty: maps are cloned between frames.
impl Clone for FrameScratch {
    fn clone(&self) -> Self {
        Self::default()
    }
}

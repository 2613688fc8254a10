use dymlm_core::BoundingBox;

use super::{GridSample, SampleGrid};

/// One cluster of a box's samples.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct BoxCluster {
    /// Samples in the box.
    pub inside: usize,
    /// Samples in the margin around it.
    pub outside: usize,
    /// Samples at the end of the margin whose surface goes on beyond it.
    pub cut: usize,
    /// Mean depth of the samples in the box, metres; of all samples when none is in the box.
    pub depth: f32,
    /// Least column and row of the samples in the box, and greatest.
    cells: [[u32; 2]; 2],
}

impl BoxCluster {
    pub(super) const NONE: Self =
        Self { inside: 0, outside: 0, cut: 0, depth: 0.0, cells: [[u32::MAX; 2], [0; 2]] };

    /// The number of samples.
    pub fn size(&self) -> usize {
        self.inside + self.outside
    }

    /// Share of the samples outside the box, 0..=1.
    pub fn outside_share(&self) -> f32 {
        self.outside as f32 / self.size().max(1) as f32
    }

    /// The box around the samples of the detection's box, pixels; `None` when there are none.
    pub fn bounds(&self, grid: &SampleGrid) -> Option<BoundingBox> {
        let [low, high] = self.cells;
        (self.inside > 0).then(|| grid.box_around(low, high)).flatten()
    }

    /// Takes a sample in; `depth` is a sum until [`Self::finish`].
    pub(super) fn add(&mut self, sample: &GridSample) {
        self.cut += usize::from(sample.is_cut);
        if !sample.is_in_box {
            self.outside += 1;
            // The depth of samples outside counts only where none is inside.
            self.depth += if self.inside == 0 { sample.point[2] } else { 0.0 };
            return;
        }
        if self.inside == 0 {
            self.depth = 0.0;
        }
        self.inside += 1;
        self.depth += sample.point[2];
        let cell = [sample.column, sample.row];
        let [low, high] = &mut self.cells;
        for ((low, high), cell) in low.iter_mut().zip(high).zip(cell) {
            *low = cell.min(*low);
            *high = cell.max(*high);
        }
    }

    pub(super) fn finish(&mut self) {
        let count = if self.inside > 0 { self.inside } else { self.outside };
        self.depth /= count.max(1) as f32;
    }
}

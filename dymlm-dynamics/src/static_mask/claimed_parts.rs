use std::ops::Range;

use super::still_parts::ComparedFrame;
use crate::block_depths::BlockDepths;

/// What corrections have added to a mover's box although another thing's detection claims it: the chair on
/// which somebody sits.
///
/// A box is corrected where the detector cut its mover short. Where it did not, the correction goes on to
/// what the mover touches. There the detector knows better: it has framed the other thing, and it has framed
/// the mover without it. What a past view has read elsewhere is the mover's all the same: a limb that was cut
/// off, or something carried.
///
/// Works on blocks of pixels: O(blocks times views).
#[derive(Debug, Clone, Default)]
pub(super) struct ClaimedParts {
    blocks: BlockDepths,
    have_moved: Vec<bool>,
}

impl ClaimedParts {
    /// Finds the other things' blocks among those of a window whose middle pixel `is_claimed`. Returns false
    /// when there are none.
    pub(super) fn find(
        &mut self,
        compared: &ComparedFrame<'_>,
        window: [Range<usize>; 2],
        is_claimed: impl Fn(usize, usize) -> bool,
    ) -> bool {
        let (frame, camera) = (compared.frame, compared.frame.camera());
        self.blocks.fill(frame.depth(), camera.size_scale(), compared.sensor, window, is_claimed);
        self.have_moved.clear();
        self.have_moved.resize(self.blocks.depths().len(), false);
        for view in compared.past.iter() {
            let view_from_camera = view.view_from(compared.world_from_camera);
            for (block, &z) in self.blocks.depths().iter().enumerate() {
                if z > 0.0 && !self.have_moved[block] {
                    let place = camera.back_project(self.blocks.center(block), z.into());
                    let place = view_from_camera.transform_point(place);
                    self.have_moved[block] = view.has_moved(place, compared.sensor) == Some(true);
                }
            }
        }
        self.released().next().is_some()
    }

    /// The other things' blocks, as columns and rows of pixels.
    pub(super) fn released(&self) -> impl Iterator<Item = [Range<usize>; 2]> {
        let blocks = self.blocks.depths().iter().zip(&self.have_moved).enumerate();
        let released = blocks.filter(|&(_, (&z, &has_moved))| z > 0.0 && !has_moved);
        released.map(|(block, _)| self.blocks.pixels(block))
    }
}

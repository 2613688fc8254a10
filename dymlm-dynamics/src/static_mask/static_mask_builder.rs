use dymlm_core::{BoundingBox, Frame, Mask};

use super::claimed_parts::ClaimedParts;
use super::silhouette::Silhouette;
use super::still_parts::{ComparedFrame, StillParts};
use super::{MaskConfig, MaskMode};
use crate::Foreground;

/// One mover to be masked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MaskRegion<'a> {
    /// Its corrected box, pixels.
    pub(crate) bounding_box: BoundingBox,
    /// The box that a detector gave, or would have given; `None` when that is not sure.
    pub(crate) sure_box: Option<BoundingBox>,
    /// Its foreground. When it is empty, the whole box is masked.
    pub(crate) foreground: &'a Foreground,
    /// The detector's instance mask: all its pixels in the box are masked.
    pub(crate) instance_mask: Option<&'a Mask>,
}

/// Builds the mask of static pixels: paper section III-A.
///
/// In [`MaskMode::Silhouette`] the silhouette starts with the pixels on the foreground's surface and grows
/// over neighbours that continue the surface in depth and lie within the foreground's range of depths. [Parts
/// that are still](StillParts) while others move are left out, and so are those [of other
/// things](ClaimedParts). Then a rim is added, wider where there is no depth. All of it stays within the
/// corrected box, and the background between legs and beside a head is kept.
///
/// Costs O(pixels in the boxes) and O(blocks times past views).
#[derive(Debug, Clone)]
pub(crate) struct StaticMaskBuilder {
    config: MaskConfig,
    silhouette: Silhouette,
    still_parts: StillParts,
    claimed_parts: ClaimedParts,
}

impl StaticMaskBuilder {
    pub(crate) fn new(config: MaskConfig) -> Self {
        Self {
            config,
            silhouette: Silhouette::default(),
            still_parts: StillParts::default(),
            claimed_parts: ClaimedParts::default(),
        }
    }

    /// Fills two masks: `is_static`, where `false` = inside a mover; and `is_mover`, where `true` = surely a
    /// mover's: its silhouette without a rim, within the box in which it surely is. What corrections add to
    /// the box is a guess, often the chair on which somebody sits. `claimed`: the pixels in detected boxes of
    /// other things. Masks of another size than the depth image are made anew.
    pub(crate) fn build<'a>(
        &mut self,
        movers: impl IntoIterator<Item = MaskRegion<'a>>,
        claimed: &Mask,
        compared: &ComparedFrame<'_>,
        [is_static, is_mover]: [&mut Mask; 2],
    ) {
        let (frame, depth) = (compared.frame, compared.frame.depth());
        // A depth image's size is never refused.
        let _ = is_static.refill(depth.width(), depth.height(), true);
        let _ = is_mover.refill(depth.width(), depth.height(), false);
        for mover in movers {
            self.silhouette.trace(&mover, depth);
            // The detector's own mask is more reliable than this search, and the mode `Box` masks all pixels.
            if self.config.mode == MaskMode::Silhouette && mover.instance_mask.is_none() {
                self.silhouette.release_still_parts(compared, &mut self.still_parts);
                if let Some(own) = &mover.sure_box {
                    let parts = &mut self.claimed_parts;
                    self.silhouette.release_claimed_parts(own, claimed, compared, parts);
                }
            }
            if let (Some(own), false) = (&mover.sure_box, mover.foreground.is_empty()) {
                self.silhouette.add_to(own, is_mover);
            }
            self.remove_traced(&mover, frame, is_static);
        }
    }

    /// Makes the pixels of one mover `false`.
    pub(crate) fn mask(&mut self, mover: &MaskRegion<'_>, frame: &Frame, is_static: &mut Mask) {
        self.silhouette.trace(mover, frame.depth());
        self.remove_traced(mover, frame, is_static);
    }

    /// Makes the pixels of the last traced mover, and of a rim around them, `false`.
    fn remove_traced(&mut self, mover: &MaskRegion<'_>, frame: &Frame, is_static: &mut Mask) {
        if self.config.mode == MaskMode::Box || mover.foreground.is_empty() {
            is_static.fill_box(&mover.bounding_box, false);
            return;
        }
        let scale = frame.camera().size_scale();
        let [dilation, shadow] = [self.config.dilation, self.config.shadow]
            .map(|length| (f64::from(length) * scale).round() as usize);
        self.silhouette.add_rim(dilation, shadow.max(dilation));
        self.silhouette.remove_from(is_static);
    }
}

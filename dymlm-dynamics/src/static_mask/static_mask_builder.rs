use dymlm_core::{BoundingBox, Frame, Mask};

use super::silhouette::Silhouette;
use super::{MaskConfig, MaskMode};
use crate::Foreground;

/// One mover to be masked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MaskRegion<'a> {
    /// Its corrected box, pixels.
    pub(crate) bounding_box: BoundingBox,
    /// The box as the detector has it; `None` when it was predicted.
    pub(crate) detected_box: Option<BoundingBox>,
    /// Its foreground. When it is empty, the whole box is masked.
    pub(crate) foreground: &'a Foreground,
    /// The detector's instance mask: all its pixels in the box are masked.
    pub(crate) instance_mask: Option<&'a Mask>,
}

/// Builds the mask of static pixels: paper section III-A.
///
/// In [`MaskMode::Silhouette`] the pixels on the foreground's surface are taken; from them the silhouette
/// grows over neighbours that continue the surface in depth and lie within the foreground's range of depths;
/// then a rim is added, wider where there is no depth. All of it stays within the corrected box, so the
/// background between legs and beside a head is kept.
///
/// Costs O(pixels in the boxes).
#[derive(Debug, Clone)]
pub(crate) struct StaticMaskBuilder {
    config: MaskConfig,
    silhouette: Silhouette,
}

impl StaticMaskBuilder {
    pub(crate) fn new(config: MaskConfig) -> Self {
        Self { config, silhouette: Silhouette::default() }
    }

    /// Fills two masks: `is_static`, where `false` = inside a mover; and `is_mover`, where `true` = surely a
    /// mover's: its silhouette, without a rim, as far as the detector's own box reaches. What corrections and
    /// predictions add is a guess, often the chair that somebody sits on. Masks of another size than the
    /// depth image are made anew.
    pub(crate) fn build<'a>(
        &mut self,
        movers: impl IntoIterator<Item = MaskRegion<'a>>,
        frame: &Frame,
        is_static: &mut Mask,
        is_mover: &mut Mask,
    ) {
        let (depth, scale) = (frame.depth(), frame.camera().size_scale());
        // A depth image's size is never refused.
        let _ = is_static.refill(depth.width(), depth.height(), true);
        let _ = is_mover.refill(depth.width(), depth.height(), false);
        let pixels = |length: f32| (f64::from(length) * scale).round() as usize;
        let dilation = pixels(self.config.dilation);
        let shadow = pixels(self.config.shadow).max(dilation);
        for mover in movers {
            if mover.foreground.is_empty() {
                is_static.fill_box(&mover.bounding_box, false);
                continue;
            }
            self.silhouette.trace(&mover, depth);
            if let Some(detected) = &mover.detected_box {
                self.silhouette.add_to(detected, is_mover);
            }
            if self.config.mode == MaskMode::Box {
                is_static.fill_box(&mover.bounding_box, false);
            } else {
                self.silhouette.add_rim(dilation, shadow);
                self.silhouette.remove_from(is_static);
            }
        }
    }
}

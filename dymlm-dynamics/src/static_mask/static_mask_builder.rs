use dymlm_core::{BoundingBox, Frame, Mask};

use super::silhouette::Silhouette;
use super::{MaskConfig, MaskMode};
use crate::Foreground;

/// One mover to be masked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MaskRegion<'a> {
    /// Its corrected box, pixels.
    pub(crate) bounding_box: BoundingBox,
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

    /// Fills the mask: `true` = static, `false` = inside a mover. A mask of another size than the depth image
    /// is made anew.
    pub(crate) fn build<'a>(
        &mut self,
        movers: impl IntoIterator<Item = MaskRegion<'a>>,
        frame: &Frame,
        is_static: &mut Mask,
    ) {
        let (depth, scale) = (frame.depth(), frame.camera().size_scale());
        // A depth image's size is never refused.
        let _ = is_static.refill(depth.width(), depth.height(), true);
        let pixels = |length: f32| (f64::from(length) * scale).round() as usize;
        let dilation = pixels(self.config.dilation);
        let shadow = pixels(self.config.shadow).max(dilation);
        for mover in movers {
            if self.config.mode == MaskMode::Box || mover.foreground.is_empty() {
                is_static.fill_box(&mover.bounding_box, false);
            } else {
                self.silhouette.trace(&mover, depth, dilation, shadow);
                self.silhouette.remove_from(is_static);
            }
        }
    }
}

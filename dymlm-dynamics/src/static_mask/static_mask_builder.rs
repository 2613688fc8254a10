use dymlm_core::{BoundingBox, DepthImage, Mask};

use super::silhouette::Silhouette;
use super::{MaskConfig, MaskMode};
use crate::image_scale::scaled_pixels;
use crate::{Error, Foreground};

/// One mover to be masked.
#[derive(Debug, Clone, Copy)]
pub struct MaskRegion<'a> {
    /// Its corrected box, pixels.
    pub bounding_box: BoundingBox,
    /// Its foreground. When it is empty, the whole box is masked.
    pub foreground: &'a Foreground,
    /// The detector's instance mask: all its pixels in the box are masked.
    pub instance_mask: Option<&'a Mask>,
}

/// Builds the mask of static pixels: paper section III-A.
///
/// In [`MaskMode::Silhouette`] the pixels on the foreground's surface are taken; from them the silhouette grows over
/// neighbours that continue the surface in depth and lie within the foreground's range of depths; then a rim is
/// added, wider where there is no depth. All of it stays within the corrected box, so the background between legs
/// and beside a head is kept.
///
/// Costs O(pixels in the boxes).
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Mask, PinholeCamera};
/// use dymlm_dynamics::*;
///
/// // Somebody at 2 m, before a wall at 3 m.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let depth = DepthImage::new(160, 120, depth)?;
/// let bounding_box = BoundingBox::new(50.0, 0.0, 110.0, 120.0)?;
///
/// let mut foreground = Foreground::new();
/// ForegroundFinder::new(ForegroundConfig::default())?.find(
///     &camera,
///     &depth,
///     &ForegroundSearch::new(bounding_box),
///     &mut foreground,
/// );
/// let mut is_static = Mask::filled(160, 120, true)?;
/// let mut builder = StaticMaskBuilder::new(MaskConfig::default())?;
/// builder.build([MaskRegion { bounding_box, foreground: &foreground, instance_mask: None }], &depth, &mut is_static);
/// assert!(!is_static.at(70, 60) && is_static.at(54, 60) && is_static.at(40, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct StaticMaskBuilder {
    config: MaskConfig,
    silhouette: Silhouette,
}

impl StaticMaskBuilder {
    /// Makes a builder.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: MaskConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self { config, silhouette: Silhouette::default() })
    }

    /// Fills the mask: `true` = static, `false` = inside a mover. A mask of another size than the depth image is
    /// made anew.
    pub fn build<'a>(
        &mut self,
        movers: impl IntoIterator<Item = MaskRegion<'a>>,
        depth: &DepthImage,
        is_static: &mut Mask,
    ) {
        // A depth image's size is never refused.
        let _ = is_static.refill(depth.width(), depth.height(), true);
        let dilation = scaled_pixels(self.config.dilation, depth.width());
        let shadow = scaled_pixels(self.config.shadow, depth.width()).max(dilation);
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

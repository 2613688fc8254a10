use dymlm_core::{DepthImage, Error, Mask};

use crate::share::share;

/// How well masks cover the movers, in pixels with a depth reading, summed over frames.
///
/// - recall = masked mover pixels / mover pixels: mover pixels that are not masked enter the map,
/// - precision = masked mover pixels / masked pixels: the other masked pixels are background lost to the map.
///
/// ```
/// use dymlm_core::{DepthImage, Mask};
/// use dymlm_metrics::MaskScore;
///
/// let depth = DepthImage::new(4, 1, vec![2.0, 2.0, 2.0, 0.0])?;
/// let movers = Mask::new(4, 1, vec![true, true, false, true])?;
/// let masked = Mask::new(4, 1, vec![true, false, true, true])?;
/// let mut score = MaskScore::default();
/// score.add(&masked, &movers, &depth)?;
/// assert_eq!((score.recall(), score.precision()), (Some(0.5), Some(0.5)));
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MaskScore {
    /// Pixels with a reading that show movers.
    pub mover_pixels: u64,
    /// Pixels with a reading that are masked.
    pub masked_pixels: u64,
    /// Pixels with a reading that show movers and are masked.
    pub masked_mover_pixels: u64,
}

impl MaskScore {
    /// Adds a frame: `masked` is `true` where a pixel is kept out of the map, `movers` where it shows a
    /// mover.
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`] when the images differ in size; nothing is added.
    pub fn add(&mut self, masked: &Mask, movers: &Mask, depth: &DepthImage) -> Result<(), Error> {
        let (width, height) = (depth.width(), depth.height());
        for (what, mask) in [("the mask", masked), ("the mask of the movers", movers)] {
            let (actual_width, actual_height) = (mask.width(), mask.height());
            if (actual_width, actual_height) != (width, height) {
                return Err(Error::SizeMismatch { what, width, height, actual_width, actual_height });
            }
        }
        let pixels = masked.pixels().zip(movers.pixels()).zip(depth.data());
        for ((masked, mover), _) in pixels.filter(|&(_, &z)| z > 0.0) {
            self.mover_pixels += u64::from(mover);
            self.masked_pixels += u64::from(masked);
            self.masked_mover_pixels += u64::from(masked && mover);
        }
        Ok(())
    }

    /// Share of the movers' pixels that are masked; `None` when there are none.
    pub fn recall(&self) -> Option<f64> {
        share(self.masked_mover_pixels, self.mover_pixels)
    }

    /// Share of the masked pixels that show movers; `None` when nothing is masked.
    pub fn precision(&self) -> Option<f64> {
        share(self.masked_mover_pixels, self.masked_pixels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_frames_and_refuses_other_sizes() {
        let depth = DepthImage::new(2, 1, vec![1.0, 1.0]).unwrap();
        let both = Mask::filled(2, 1, true).unwrap();
        let left = Mask::new(2, 1, vec![true, false]).unwrap();
        let mut score = MaskScore::default();
        assert_eq!((score.recall(), score.precision()), (None, None));
        score.add(&left, &both, &depth).unwrap();
        score.add(&both, &left, &depth).unwrap();
        assert_eq!(score.recall(), Some(2.0 / 3.0));
        assert_eq!(score.precision(), Some(2.0 / 3.0));

        let before = score;
        let error = score.add(&left, &Mask::filled(1, 2, true).unwrap(), &depth).unwrap_err();
        assert!(matches!(error, Error::SizeMismatch { width: 2, actual_width: 1, .. }), "{error}");
        assert_eq!(score, before);
    }
}

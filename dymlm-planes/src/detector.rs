use dymlm_core::{BoundingBox, DepthImage, Mask, PinholeCamera};

use crate::extraction::{Extraction, PlaneExtractor};
use crate::filter::{PlaneFilter, RejectedPlane};
use crate::refinement::{DetectedPlane, PlaneRefiner};
use crate::{PlaneConfig, PlaneError};

/// The steps of a single frame: extract, refine, filter. Owns their buffers.
///
/// Each step can be called by itself, in this order; [`PlaneDetector::detect`] calls all three.
#[derive(Debug, Clone)]
pub struct PlaneDetector {
    extractor: PlaneExtractor,
    refiner: PlaneRefiner,
    filter: PlaneFilter,
}

impl PlaneDetector {
    /// A detector with empty buffers; of the config its parts `extraction`, `refinement` and `filter`.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Config`] names the field outside its range.
    pub fn new(config: &PlaneConfig) -> Result<Self, PlaneError> {
        Ok(Self {
            extractor: PlaneExtractor::new(config.extraction.clone())?,
            refiner: PlaneRefiner::new(config.refinement.clone())?,
            filter: PlaneFilter::new(config.filter.clone())?,
        })
    }

    /// Finds the planes of a frame that may enter the map, in the camera frame. Pixels whose entry in `static_mask` is
    /// false take no part; `movers` are the corrected boxes of potential movers.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Core`] when image or mask are of another size than the camera.
    pub fn detect(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        static_mask: Option<&Mask>,
        movers: &[BoundingBox],
    ) -> Result<&[DetectedPlane], PlaneError> {
        self.extract(camera, depth, static_mask)?;
        self.refine(camera, depth)?;
        self.filter(movers);
        Ok(self.planes())
    }

    /// Step 1: finds the planes of the depth image.
    ///
    /// # Errors
    ///
    /// As [`PlaneExtractor::extract`].
    pub fn extract(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        static_mask: Option<&Mask>,
    ) -> Result<&Extraction, PlaneError> {
        self.extractor.extract(camera, depth, static_mask)
    }

    /// Step 2: fits them again, robustly.
    ///
    /// # Errors
    ///
    /// As [`PlaneRefiner::refine`].
    pub fn refine(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
    ) -> Result<&[DetectedPlane], PlaneError> {
        self.refiner.refine(camera, depth, self.extractor.extraction())
    }

    /// Step 3: drops those that should not reach the map.
    pub fn filter(&mut self, movers: &[BoundingBox]) -> &[RejectedPlane] {
        self.filter.filter(self.refiner.planes_mut(), self.extractor.extraction(), movers)
    }

    /// The last extraction, with a label for each pixel.
    pub fn extraction(&self) -> &Extraction {
        self.extractor.extraction()
    }

    /// The planes of the last frame, after the last step called. Camera frame.
    pub fn planes(&self) -> &[DetectedPlane] {
        self.refiner.planes()
    }

    /// What the last call of [`PlaneDetector::filter`] dropped.
    pub fn rejected(&self) -> &[RejectedPlane] {
        self.filter.rejected()
    }
}

use dymlm_core::{BoundingBox, Frame, Mask, SensorModel};

use super::config::PlaneDetectorConfig;
use super::detected_plane::DetectedPlane;
use super::extraction::PlaneExtractor;
use super::filter::{PlaneFilter, RejectedPlane};
use super::refinement::PlaneRefiner;
use crate::error::Error;

/// Finds the planes of a frame (the first half of the paper's section III-B).
///
/// 1. **Extraction** by agglomerative clustering of blocks of the depth image, then growing pixel by pixel
///    (Feng, Taguchi, Kamat: "Fast Plane Extraction in Organized Point Clouds Using Agglomerative
///    Hierarchical Clustering", ICRA 2014).
/// 2. **Refinement**: a robust fit (reweighted least squares with Tukey's biweight) with inliers and
///    covariance. The paper uses PCL's RANSAC; reweighting needs no random numbers and converges to a fit
///    on all inliers.
/// 3. **Filter**: planes that are too small, too uncertain, or on a mover are rejected.
///
/// Tolerances are physical: they follow the sensor's noise. O(pixels + blocks log blocks). The detector owns
/// its buffers: after the first frames nothing is allocated.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, SensorModel};
/// use dymlm_planes::{PlaneDetector, PlaneDetectorConfig};
///
/// // A floor half a metre below the camera, and a wall 2 m before it.
/// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
/// let depth = |i: usize| {
///     let ray_y = ((i / 160) as f32 - 59.5) / 131.0;
///     if ray_y > 0.25 { 0.5 / ray_y } else { 2.0 }
/// };
/// let depth = DepthImage::new(160, 120, (0..160 * 120).map(depth).collect())?;
/// let frame = Frame::new(0.0, camera, depth, None)?;
///
/// let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect())?;
/// let [wall, floor] = detector.detect(&frame, None, &[])? else { panic!("two planes") };
/// assert!(wall.plane.normal()[2] < -0.999 && floor.plane.normal()[1] < -0.999);
/// let labels = [wall.label, floor.label];
/// assert_eq!([5, 110].map(|v| detector.labels()[v * 160 + 80]), labels);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
#[doc(alias = "PEAC")]
#[doc(alias = "plane segmentation")]
pub struct PlaneDetector {
    extractor: PlaneExtractor,
    refiner: PlaneRefiner,
    filter: PlaneFilter,
}

impl PlaneDetector {
    /// A detector with empty buffers.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] names the field outside its range.
    pub fn new(config: &PlaneDetectorConfig, sensor: &SensorModel) -> Result<Self, Error> {
        config.validate()?;
        sensor.validate()?;
        Ok(Self {
            extractor: PlaneExtractor::new(config, *sensor),
            refiner: PlaneRefiner::new(*sensor),
            filter: PlaneFilter::new(config, *sensor),
        })
    }

    /// Finds the planes of a frame that may enter the map, in the camera's frame, largest support first.
    /// Pixels for which `static_mask` is false are ignored; `movers` are the corrected boxes of potential
    /// movers, pixels.
    ///
    /// # Errors
    ///
    /// [`Error::Core`] when the mask has another size than the camera; the last result stays.
    pub fn detect(
        &mut self,
        frame: &Frame,
        static_mask: Option<&Mask>,
        movers: &[BoundingBox],
    ) -> Result<&[DetectedPlane], Error> {
        let (camera, depth) = (frame.camera(), frame.depth());
        self.extractor.extract(camera, depth, static_mask)?;
        self.refiner.refine(camera, depth, self.extractor.rays(), self.extractor.extraction());
        self.filter.filter(self.refiner.planes_mut(), self.extractor.extraction(), movers);
        Ok(self.planes())
    }

    /// The planes of the last frame that may enter the map.
    pub fn planes(&self) -> &[DetectedPlane] {
        self.refiner.planes()
    }

    /// The planes of the last frame that were rejected.
    pub fn rejected(&self) -> &[RejectedPlane] {
        self.filter.rejected()
    }

    /// For each pixel of the last frame, row by row, the label of its plane, accepted or rejected; 0 = no
    /// plane.
    pub fn labels(&self) -> &[u16] {
        self.extractor.extraction().labels()
    }
}

use dymlm_core::{BoundingBox, Frame, Mask, Pose};

use crate::detector::PlaneDetector;
use crate::plane_map::{PlaneMap, PlaneReport};
use crate::{PlaneConfig, PlaneError};

/// The whole plane step of the paper (III-B): extract, refine, filter, then associate, fuse, merge.
///
/// Joins a [`PlaneDetector`] and a [`PlaneMap`]; both can be used by themselves.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm_planes::{PlaneConfig, PlaneMapper};
///
/// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
/// let wall = Frame::new(0.0, camera, DepthImage::new(160, 120, vec![2.0; 160 * 120])?, None)?;
///
/// let mut mapper = PlaneMapper::new(PlaneConfig::default())?;
/// let first = mapper.insert(&wall, None, &[], &Pose::identity())?;
/// let nearer = Pose::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
/// let second = mapper.insert(&wall, None, &[], &nearer)?;
/// assert_eq!((first.created.len(), second.created.len(), second.updated), (1, 0, first.created));
/// assert_eq!(mapper.map().planes()[0].observations(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PlaneMapper {
    detector: PlaneDetector,
    map: PlaneMap,
}

impl PlaneMapper {
    /// A mapper with an empty map.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Config`] names the field outside its range.
    pub fn new(config: PlaneConfig) -> Result<Self, PlaneError> {
        Ok(Self { detector: PlaneDetector::new(&config)?, map: PlaneMap::new(config.map)? })
    }

    /// Adds the planes of a key frame to the map. Pixels whose entry in `static_mask` is false take no part; `movers`
    /// are the corrected boxes of potential movers.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Core`] for a mask of another size; [`PlaneError::OutOfReach`]. The map stays as it was.
    pub fn insert(
        &mut self,
        frame: &Frame,
        static_mask: Option<&Mask>,
        movers: &[BoundingBox],
        world_from_camera: &Pose,
    ) -> Result<PlaneReport, PlaneError> {
        self.detector.extract(frame.camera(), frame.depth(), static_mask)?;
        self.detector.refine(frame.camera(), frame.depth())?;
        let rejected = self.detector.filter(movers).to_vec();

        let mut report = self.map.insert_frame(self.detector.planes(), frame, world_from_camera)?;
        report.rejected = rejected;
        Ok(report)
    }

    /// The steps of the last frame: its labels, its planes, what was rejected.
    pub fn detector(&self) -> &PlaneDetector {
        &self.detector
    }

    /// The map.
    pub fn map(&self) -> &PlaneMap {
        &self.map
    }

    /// The map, to take key frames out.
    pub fn map_mut(&mut self) -> &mut PlaneMap {
        &mut self.map
    }

    /// Gives the map away.
    pub fn into_map(self) -> PlaneMap {
        self.map
    }
}

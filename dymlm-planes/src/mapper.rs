use dymlm_core::{BoundingBox, Frame, Mask, Pose, SensorModel};

use crate::config::PlaneConfig;
use crate::detector::PlaneDetector;
use crate::error::Error;
use crate::plane_map::{PlaneMap, PlaneReport};

/// The whole plane step of the paper (III-B): extract, refine, filter, then associate, fuse, merge.
///
/// Joins a [`PlaneDetector`] and a [`PlaneMap`]; each can be used alone.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
/// use dymlm_planes::{PlaneConfig, PlaneMapper};
///
/// let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5)?;
/// let wall = Frame::new(0.0, camera, DepthImage::new(160, 120, vec![2.0; 160 * 120])?, None)?;
///
/// let mut mapper = PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect())?;
/// let first = mapper.insert(&wall, None, &[], &Pose::identity())?;
/// let aside = Pose::new([0.3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
/// let second = mapper.insert(&wall, None, &[], &aside)?;
/// assert_eq!((first.created.len(), second.created.len()), (1, 0));
/// assert_eq!(second.updated, first.created);
/// let wall = mapper.map().plane(first.created[0]).ok_or("no such plane")?;
/// assert_eq!((wall.observations(), wall.is_confirmed()), (2, true));
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
    /// [`Error::Config`] names the field outside its range.
    pub fn new(config: PlaneConfig, sensor: SensorModel) -> Result<Self, Error> {
        Ok(Self {
            detector: PlaneDetector::new(&config.detector, &sensor)?,
            map: PlaneMap::new(config.map, sensor)?,
        })
    }

    /// Adds the planes of a key frame to the map. Pixels for which `static_mask` is false are ignored;
    /// `movers` are the corrected boxes of potential movers, pixels.
    ///
    /// # Errors
    ///
    /// [`Error::Core`] for a mask of another size than the frame; [`Error::OutOfReach`]. The map stays as it
    /// was.
    pub fn insert(
        &mut self,
        frame: &Frame,
        static_mask: Option<&Mask>,
        movers: &[BoundingBox],
        world_from_camera: &Pose,
    ) -> Result<PlaneReport, Error> {
        let found = self.detector.detect(frame, static_mask, movers)?;
        let mut report = self.map.insert(found, frame, world_from_camera)?;
        report.rejected = self.detector.rejected().to_vec();
        Ok(report)
    }

    /// The detector, with the last frame's labels, planes and rejected planes.
    pub fn detector(&self) -> &PlaneDetector {
        &self.detector
    }

    /// The map.
    pub fn map(&self) -> &PlaneMap {
        &self.map
    }

    /// The map, to remove key frames from it.
    pub fn map_mut(&mut self) -> &mut PlaneMap {
        &mut self.map
    }

    /// Returns the map and drops the detector.
    pub fn into_map(self) -> PlaneMap {
        self.map
    }
}

use std::sync::Arc;

use dymlm_cloud::CloudMap;
use dymlm_core::{Frame, Pose};
use dymlm_objects::{ObjectMap, ObjectMapper};
use dymlm_octree::Octree;
use dymlm_planes::PlaneMap;

use crate::ghost_removal::GhostRemoval;
use crate::key_frame_view::{SplitMaps, ThingMaps};
use crate::past::Past;
use crate::{Error, MapConfig, Revision};

/// The maps of the static world, in one world frame.
///
/// A clone shares with the original what neither has changed since.
#[derive(Debug, Clone)]
pub struct MultiLevelMap {
    pub(crate) config: Arc<MapConfig>,
    pub(crate) cloud: CloudMap,
    pub(crate) octree: Octree,
    pub(crate) planes: PlaneMap,
    pub(crate) objects: ObjectMapper,
    pub(crate) ghost_removal: GhostRemoval,
    pub(crate) revision: Revision,
    pub(crate) past: Past,
}

impl MultiLevelMap {
    /// Empty maps, without a past.
    pub(crate) fn new(config: &Arc<MapConfig>) -> Result<Self, Error> {
        Ok(Self {
            config: Arc::clone(config),
            cloud: CloudMap::new(config.cloud.clone(), config.sensor)?,
            octree: Octree::new(config.octree.clone())?,
            planes: PlaneMap::new(config.planes.map.clone(), config.sensor)?,
            objects: ObjectMapper::new(config.objects.clone(), config.sensor)?,
            ghost_removal: GhostRemoval::default(),
            revision: Revision::default(),
            past: Past::default(),
        })
    }

    /// The same maps, without their past.
    pub(crate) fn without_past(&self) -> Self {
        Self {
            config: Arc::clone(&self.config),
            cloud: self.cloud.clone(),
            octree: self.octree.clone(),
            planes: self.planes.clone(),
            objects: self.objects.clone(),
            ghost_removal: self.ghost_removal.clone(),
            revision: self.revision,
            past: Past::default(),
        }
    }

    /// The config that the maps were made with.
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// The dense coloured cloud.
    pub fn cloud(&self) -> &CloudMap {
        &self.cloud
    }

    /// The occupancy octree.
    pub fn octree(&self) -> &Octree {
        &self.octree
    }

    /// The finite planes.
    pub fn planes(&self) -> &PlaneMap {
        &self.planes
    }

    /// The objects.
    pub fn objects(&self) -> &ObjectMap {
        self.objects.map()
    }

    /// The number of this state of the maps: it grows whenever they change.
    pub fn revision(&self) -> Revision {
        self.revision
    }

    /// Notes that the maps have changed.
    pub(crate) fn change(&mut self) {
        self.revision.0 += 1;
    }

    /// The maps in parts that can be built at the same time.
    pub(crate) fn split(&mut self) -> SplitMaps<'_> {
        let Self { cloud, octree, planes, objects, .. } = self;
        SplitMaps { cloud, octree, things: ThingMaps { planes, objects } }
    }

    /// Checks that the maps would take a frame from this pose, before any of them changes. The octree takes a
    /// frame from anywhere, and leaves out what is beyond its cells.
    pub(crate) fn check_reach(&self, frame: &Frame, world_from_camera: &Pose) -> Result<(), Error> {
        self.cloud.check_reach(frame, world_from_camera)?;
        self.planes.check_reach(world_from_camera)?;
        Ok(())
    }

    /// Forgets what lies farther than `radius` metres from a place.
    pub(crate) fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        self.cloud.forget_outside(center, radius);
        self.octree.forget_outside(center, radius);
        self.planes.forget_outside(center, radius);
        self.objects.forget_outside(center, radius);
    }
}

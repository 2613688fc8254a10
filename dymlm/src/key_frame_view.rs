use dymlm_cloud::{CloudFrameReport, CloudMap, MoverMasks};
use dymlm_core::{Detection, Frame, Mask, Pose, SensorModel};
use dymlm_history::{History, Observation};
use dymlm_objects::{ObjectMapper, ObjectReport, ObjectView, SightedPoint};
use dymlm_octree::{InsertReport, Octree};
use dymlm_planes::{DetectedPlane, PlaneMap, PlaneReport};

use crate::stages::{StageClock, timed};
use crate::supporting_planes::MappedPlanes;
use crate::{Error, MapUpdate, MultiLevelMap, Stage};

/// All that a key frame brings into the maps, in its camera's coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KeyFrameView<'a> {
    pub(crate) frame: &'a Frame,
    pub(crate) static_mask: &'a Mask,
    pub(crate) mover_mask: &'a Mask,
    pub(crate) unproven_mask: &'a Mask,
    pub(crate) detections: Option<&'a [Detection]>,
    pub(crate) sighted_points: &'a [SightedPoint],
    /// Empty until they are detected.
    pub(crate) planes: &'a [DetectedPlane],
}

/// Parts of the config that mapping needs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MappingContext<'a> {
    pub(crate) sensor: &'a SensorModel,
    pub(crate) mover_labels: &'a [String],
}

/// The maps in three parts, none of which reads another while a key frame is mapped, so that they can be built
/// at the same time.
pub(crate) struct SplitMaps<'a> {
    pub(crate) cloud: &'a mut CloudMap,
    pub(crate) octree: &'a mut Octree,
    pub(crate) things: ThingMaps<'a>,
}

/// The maps of planes and of objects; objects stand on planes.
pub(crate) struct ThingMaps<'a> {
    pub(crate) planes: &'a mut PlaneMap,
    pub(crate) objects: &'a mut ObjectMapper,
}

impl<'a> KeyFrameView<'a> {
    /// The view of an observation that was kept.
    pub(crate) fn of(observation: &'a Observation) -> Self {
        Self {
            frame: &observation.frame,
            static_mask: &observation.static_mask,
            mover_mask: &observation.mover_mask,
            unproven_mask: &observation.unproven_mask,
            detections: observation.detections.as_deref(),
            sighted_points: &observation.sighted_points,
            planes: &observation.planes,
        }
    }

    /// The observation that is to be kept.
    pub(crate) fn to_observation(self, history: &mut History) -> Result<Observation, Error> {
        let mut observation = history.observe(self.frame)?;
        observation.static_mask.clone_from(self.static_mask);
        observation.mover_mask.clone_from(self.mover_mask);
        observation.unproven_mask.clone_from(self.unproven_mask);
        observation.detections = self.detections.map(<[Detection]>::to_vec);
        observation.sighted_points = self.sighted_points.to_vec();
        observation.planes = self.planes.to_vec();
        Ok(observation)
    }

    /// Brings the key frame into all four maps: the second half of the paper's figure 2. `detect_planes` finds
    /// the frame's planes. Cloud and octree, which together take about as long as planes and objects, are built
    /// beside these; the octree by the thread that is free first.
    pub(crate) fn map<'p>(
        &self,
        map: &mut MultiLevelMap,
        world_from_camera: &Pose,
        context: &MappingContext<'_>,
        clock: &mut StageClock,
        detect_planes: impl FnOnce() -> Result<&'p [DetectedPlane], Error> + Send,
    ) -> Result<MapUpdate, Error> {
        let SplitMaps { cloud, octree, mut things } = map.split();
        let map_cloud = || timed(|| self.map_cloud(cloud, world_from_camera));
        let map_octree = || timed(|| self.map_octree(octree, world_from_camera, context));
        let map_things = || {
            let planes = clock.time(Stage::PlaneDetection, detect_planes)?;
            KeyFrameView { planes, ..*self }.map_things(&mut things, world_from_camera, context, clock)
        };
        let ((cloud, octree), things) =
            crate::parallel::join(|| crate::parallel::join(map_cloud, map_octree), map_things);
        let (cloud, octree) = (clock.note(Stage::Cloud, cloud)?, clock.note(Stage::Octree, octree)?);
        let (planes, mut objects) = things?;
        let time = self.frame.timestamp();
        let freed = clock.time(Stage::GhostRemoval, || map.remove_ghosts_when_due(time));
        objects.removed.extend(freed.removed);
        objects.updated.extend(freed.updated);
        objects.updated.sort_unstable();
        objects.updated.dedup();
        Ok(MapUpdate { cloud, octree, planes, objects })
    }

    /// Brings the key frame into the cloud.
    pub(crate) fn map_cloud(
        &self,
        cloud: &mut CloudMap,
        world_from_camera: &Pose,
    ) -> Result<CloudFrameReport, Error> {
        let masks =
            MoverMasks::new(self.static_mask).with_movers(self.mover_mask).with_unproven(self.unproven_mask);
        Ok(cloud.insert(self.frame, Some(masks), world_from_camera)?)
    }

    /// Brings the key frame into the octree.
    pub(crate) fn map_octree(
        &self,
        octree: &mut Octree,
        world_from_camera: &Pose,
        context: &MappingContext<'_>,
    ) -> Result<InsertReport, Error> {
        Ok(octree.insert_depth(self.frame, context.sensor, Some(self.static_mask), world_from_camera)?)
    }

    /// Brings the key frame's planes into their map, then its objects, which stand on them.
    pub(crate) fn map_things(
        &self,
        maps: &mut ThingMaps<'_>,
        world_from_camera: &Pose,
        context: &MappingContext<'_>,
        clock: &mut StageClock,
    ) -> Result<(PlaneReport, ObjectReport), Error> {
        let ThingMaps { planes, objects } = maps;
        let view = self.object_view(world_from_camera, context)?;
        Ok((
            clock.time(Stage::PlaneMap, || planes.insert(self.planes, self.frame, world_from_camera))?,
            clock.time(Stage::Objects, || objects.insert(&view, &MappedPlanes(planes)))?,
        ))
    }

    /// The frame as the object map takes it in: its static pixels, and the detections of things that are no
    /// movers.
    fn object_view(&self, pose: &Pose, context: &MappingContext<'a>) -> Result<ObjectView<'a>, Error> {
        let view = match self.detections {
            Some(found) => ObjectView::new(self.frame, found, pose),
            None => ObjectView::without_detector_run(self.frame, pose),
        };
        Ok(view
            .with_static_mask(self.static_mask)?
            .with_sighted_points(self.sighted_points)
            .without_labels(context.mover_labels))
    }
}

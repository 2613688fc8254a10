use dymlm_cloud::MoverMasks;
use dymlm_core::{Detection, Frame, Mask, Pose, SensorModel};
use dymlm_history::Observation;
use dymlm_objects::{ObjectView, SightedPoint};
use dymlm_planes::DetectedPlane;

use crate::ghost_removal::GhostRemoval;
use crate::stages::StageClock;
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
    pub(crate) planes: &'a [DetectedPlane],
}

/// What mapping needs to know besides: parts of the config.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MappingContext<'a> {
    pub(crate) sensor: &'a SensorModel,
    pub(crate) mover_labels: &'a [String],
}

impl<'a> KeyFrameView<'a> {
    /// What was kept of a key frame.
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

    /// What is to be kept of it.
    pub(crate) fn to_observation(self) -> Result<Observation, Error> {
        let mut observation = Observation::of_frame(self.frame)?;
        observation.static_mask.clone_from(self.static_mask);
        observation.mover_mask.clone_from(self.mover_mask);
        observation.unproven_mask.clone_from(self.unproven_mask);
        observation.detections = self.detections.map(<[Detection]>::to_vec);
        observation.sighted_points = self.sighted_points.to_vec();
        observation.planes = self.planes.to_vec();
        Ok(observation)
    }

    /// Brings the key frame into all four maps: the second half of the paper's figure 2, a step a line. The same
    /// for a new frame and for one that is mapped again at another pose.
    pub(crate) fn map(
        &self,
        map: &mut MultiLevelMap,
        ghost_removal: &mut GhostRemoval,
        world_from_camera: &Pose,
        context: &MappingContext<'_>,
        clock: &mut StageClock,
    ) -> Result<MapUpdate, Error> {
        let (frame, pose, time) = (self.frame, world_from_camera, self.frame.timestamp());
        let masks =
            MoverMasks::new(self.static_mask).with_movers(self.mover_mask).with_unproven(self.unproven_mask);
        let view = self.object_view(pose, context)?;

        let cloud = clock.time(Stage::Cloud, || map.cloud.insert(frame, Some(masks), pose))?;
        let octree = clock.time(Stage::Octree, || {
            map.octree.insert_depth(frame, context.sensor, Some(self.static_mask), pose)
        })?;
        let planes = clock.time(Stage::PlaneMap, || map.planes.insert(self.planes, frame, pose))?;
        let mut objects =
            clock.time(Stage::Objects, || map.objects.insert(&view, &MappedPlanes(&map.planes)))?;
        let gone = clock.time(Stage::GhostRemoval, || ghost_removal.run_when_due(time, map));

        objects.removed.extend(gone);
        Ok(MapUpdate { cloud, octree, planes, objects })
    }

    /// The frame as the object map takes it in: its static pixels, and the detections of what is no mover.
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

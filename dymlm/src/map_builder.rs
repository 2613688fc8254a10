use dymlm_core::{BoundingBox, Detection, Frame, Pose};
use dymlm_dynamics::Preprocessor;
use dymlm_geometry::OrientedBox;
use dymlm_objects::ObjectView;
use dymlm_planes::PlaneDetector;

use crate::key_frames::KeyFrames;
use crate::stages::StageClock;
use crate::supporting_planes::MappedPlanes;
use crate::{Error, FrameReport, MapConfig, MapUpdate, MultiLevelMap, Stage};

/// Builds the maps from frames, detections and poses, one frame at a time (the paper's figure 2).
#[derive(Debug)]
pub struct MapBuilder {
    config: MapConfig,
    preprocessor: Preprocessor,
    plane_detector: PlaneDetector,
    /// The corrected boxes of the frame's movers.
    mover_boxes: Vec<BoundingBox>,
    key_frames: KeyFrames,
    /// Where a carried object is in the next frame, with a rim, in the world.
    pub(crate) carried: Option<OrientedBox>,
    pub(crate) map: MultiLevelMap,
}

impl MapBuilder {
    /// Makes a builder with empty maps.
    ///
    /// # Errors
    ///
    /// Names the field of the config that is outside its range.
    pub fn new(config: MapConfig) -> Result<Self, Error> {
        Ok(Self {
            preprocessor: Preprocessor::new(config.dynamics.clone())?,
            plane_detector: PlaneDetector::new(&config.planes)?,
            mover_boxes: Vec::new(),
            key_frames: KeyFrames::new(config.key_frames)?,
            carried: None,
            map: MultiLevelMap::new(&config)?,
            config,
        })
    }

    /// Takes in one frame: `detections` in it (all labels; which of them may move is configuration) and the pose that
    /// takes its camera coordinates to the world. Frames come in the order of their time.
    ///
    /// The cost does not grow with the number of frames before, but for the moment in which two map planes prove to be one
    /// (all key frames are looked through once).
    ///
    /// # Errors
    ///
    /// [`Error::Dynamics`] when time runs backwards or an instance mask is of another size than the frame;
    /// [`Error::Cloud`], [`Error::Octree`] and [`Error::Planes`] when the pose lies outside what the maps can reach. The builder stays as
    /// it was.
    pub fn insert(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<FrameReport, Error> {
        self.map.check_reach(frame, world_from_camera)?;
        let mut clock = StageClock::start();

        self.preprocessor.track(frame, detections, world_from_camera)?;
        clock.end(Stage::Tracking);
        self.preprocessor.find_foregrounds(frame, detections);
        clock.end(Stage::Foreground);
        self.preprocessor.compensate_misses();
        clock.end(Stage::Compensation);
        self.preprocessor.correct_boxes(frame);
        clock.end(Stage::Correction);
        self.preprocessor.mask_movers(frame, detections);
        if let Some(body) = self.carried.take() {
            self.preprocessor.mask_body(frame, &body.transformed(&world_from_camera.inverse()));
        }
        clock.end(Stage::Mask);

        let update = if self.key_frames.choose(world_from_camera) {
            Some(self.update_maps(frame, detections, world_from_camera, &mut clock)?)
        } else {
            None
        };

        let mask = self.preprocessor.static_mask();
        Ok(FrameReport {
            timestamp: frame.timestamp(),
            movers: self.preprocessor.movers().to_vec(),
            masked_pixels: mask.data().len() - mask.count(),
            update,
            stages: clock.finish(),
        })
    }

    fn update_maps(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
        clock: &mut StageClock,
    ) -> Result<MapUpdate, Error> {
        let mask = Some(self.preprocessor.static_mask());

        let cloud = self.map.cloud.insert(frame, mask, world_from_camera)?;
        clock.end(Stage::Cloud);
        let (camera, depth, color) = (frame.camera(), frame.depth(), frame.color());
        let octree = self.map.octree.insert_depth(camera, depth, mask, color, world_from_camera)?;
        clock.end(Stage::Octree);

        self.plane_detector.extract(camera, depth, mask)?;
        clock.end(Stage::PlaneExtraction);
        self.plane_detector.refine(camera, depth)?;
        self.mover_boxes.clear();
        self.mover_boxes.extend(self.preprocessor.movers().iter().map(|mover| mover.corrected_box));
        let rejected = self.plane_detector.filter(&self.mover_boxes).to_vec();
        clock.end(Stage::PlaneRefinement);
        let found = self.plane_detector.planes();
        let mut planes = self.map.planes.insert_frame(found, frame, world_from_camera)?;
        planes.rejected = rejected;
        clock.end(Stage::PlaneMap);

        let view = ObjectView::new(frame, detections, world_from_camera)
            .with_static_mask(self.preprocessor.static_mask())?
            .without_labels(&self.config.dynamics.mover_labels);
        let supports = MappedPlanes(&self.map.planes);
        self.map.objects.parameterize(&view, &supports)?;
        clock.end(Stage::ObjectParameterization);
        self.map.objects.associate(&view);
        clock.end(Stage::ObjectAssociation);
        self.map.objects.update(&view);
        clock.end(Stage::ObjectUpdate);
        self.map.objects.optimize(&view);
        let objects = self.map.objects.take_report();
        clock.end(Stage::ObjectOptimization);

        Ok(MapUpdate { cloud, octree, planes, objects })
    }

    /// The maps as they stand.
    pub fn map(&self) -> &MultiLevelMap {
        &self.map
    }

    /// The preprocessing of the last frame: its movers and its static mask.
    pub fn preprocessor(&self) -> &Preprocessor {
        &self.preprocessor
    }

    /// The planes of the last key frame: their labels in the image, and those that did not reach the map.
    pub fn plane_detector(&self) -> &PlaneDetector {
        &self.plane_detector
    }

    /// The config.
    pub fn config(&self) -> &MapConfig {
        &self.config
    }

    /// Gives the maps away.
    pub fn into_map(self) -> MultiLevelMap {
        self.map
    }
}

use std::collections::BTreeMap;
use std::sync::Arc;

use dymlm_core::{Detection, Frame, FrameId, ObjectId, Pose};
use dymlm_dynamics::{Preprocessor, SceneKnowledge, check_timestamp};
use dymlm_geometry::OrientedBox;
use dymlm_history::{History, Observation};
use dymlm_planes::PlaneDetector;

use crate::carried_object::Followed;
use crate::key_frame_view::{KeyFrameView, MappingContext};
use crate::key_frames::{KeyFrames, Viewed};
use crate::logged_sessions::Session;
use crate::map_pager::MapPager;
use crate::publisher::Publisher;
use crate::scans::ScanMapper;
use crate::session_clock::SessionClock;
use crate::session_log::{Event, InsertedFrame, SessionLog};
use crate::snapshots::Snapshots;
use crate::stages::StageClock;
use crate::subsampler::{Subsampler, in_all_pixels, masked_in_all_pixels};
use crate::waiting_frames::WaitingFrames;
use crate::{
    Detections, Error, FrameInput, FrameOutcome, FrameReport, MapConfig, MapReader, MapUpdate, MultiLevelMap,
    Stage,
};

/// Builds the maps from frames, detections and poses, one frame at a time (the paper's figure 2).
///
/// Frames come in the order of their time. Each is a [`FrameInput`]: images, what the detector says
/// ([`Detections`]), and the pose. The cost of a frame depends on what it sees, not on the number of frames
/// before; but where two map planes prove to be one, the key frames since the younger one appeared are asked.
#[derive(Debug)]
pub struct MapBuilder {
    pub(crate) config: Arc<MapConfig>,
    pub(crate) preprocessor: Preprocessor,
    plane_detector: PlaneDetector,
    pub(crate) key_frames: KeyFrames,
    subsampler: Subsampler,
    pub(crate) waiting: WaitingFrames,
    /// Of frames that have waited and were processed by a call that reports none.
    pub(crate) released: Vec<FrameReport>,
    /// The last frame that was given to the preprocessor and the choice of key frames in this session: not the
    /// newest one where frames wait, and never a scan.
    pub(crate) processed: Option<FrameId>,
    pub(crate) snapshots: Snapshots,
    pub(crate) clock: SessionClock,
    /// The objects that somebody carries.
    pub(crate) followed: BTreeMap<ObjectId, Followed>,
    pub(crate) map: MultiLevelMap,
    pub(crate) publisher: Publisher,
    pub(crate) scan_mapper: ScanMapper,
    pub(crate) pager: MapPager,
}

impl MapBuilder {
    /// Makes a builder with empty maps.
    ///
    /// # Errors
    ///
    /// An error that names the field of the config that is outside its range; [`Error::History`] and
    /// [`Error::Paging`] for a folder in which no file can be made; with feature `io` also for a path that cannot
    /// be saved with the maps.
    pub fn new(config: MapConfig) -> Result<Self, Error> {
        config.validate()?;
        #[cfg(feature = "io")]
        config.check_paths()?;
        let config = Arc::new(config);
        let mut map = MultiLevelMap::new(&config)?;
        map.past.log = History::new(&config.history)?.map(SessionLog::new);
        Self::of_map(map)
    }

    /// A builder that goes on with maps; it knows of no movers yet.
    pub(crate) fn of_map(map: MultiLevelMap) -> Result<Self, Error> {
        let config = Arc::clone(&map.config);
        Ok(Self {
            preprocessor: Preprocessor::new(config.dynamics.clone(), config.sensor)?,
            plane_detector: PlaneDetector::new(&config.planes.detector, &config.sensor)?,
            key_frames: KeyFrames::new(config.key_frames)?,
            subsampler: Subsampler::new(config.sensor),
            waiting: WaitingFrames::default(),
            released: Vec::new(),
            processed: None,
            snapshots: Snapshots::new(),
            clock: SessionClock::default(),
            followed: BTreeMap::new(),
            map,
            publisher: Publisher::default(),
            scan_mapper: ScanMapper::default(),
            pager: MapPager::new(&config.memory, || 0)?,
            config,
        })
    }

    /// Takes in one frame: what the detector says of it (all labels; the config says which of them may move)
    /// and the pose that takes its camera coordinates to the world.
    ///
    /// A frame with [`Detections::Pending`] waits for [`detections_for`](Self::detections_for), and all
    /// frames after it wait behind it, for at most [`MapConfig::max_detection_delay`].
    ///
    /// # Errors
    ///
    /// [`Error::Dynamics`] when time runs backwards or is not in seconds, or an instance mask is of another
    /// size than the frame; [`Error::Core`] when the stride leaves too little of the frame; [`Error::Cloud`] and
    /// [`Error::Planes`] when the pose lies outside what the maps can reach; [`Error::Octree`] when the frame's
    /// rays would pass too many cells; [`Error::Paging`]. The builder stays as it was.
    #[doc(alias = "integrate")]
    pub fn insert<'a>(
        &mut self,
        frame: &Frame,
        found: impl Into<Detections<'a>>,
        world_from_camera: &Pose,
    ) -> Result<FrameReport, Error> {
        // Converted first: frame and detections may have different lifetimes.
        let found: Detections<'_> = found.into();
        self.insert_frame(&FrameInput::new(frame, found, world_from_camera))
    }

    /// [`insert`](Self::insert) with everything that a caller may know of a frame.
    ///
    /// # Errors
    ///
    /// As [`insert`](Self::insert).
    pub fn insert_frame(&mut self, input: &FrameInput<'_>) -> Result<FrameReport, Error> {
        self.check(input)?;
        self.pager.page_out(&mut self.map, &mut self.snapshots)?;
        let (id, mut released) = self.begin_input(input.frame.timestamp(), &input.world_from_camera)?;
        let carried: Vec<OrientedBox> =
            self.followed.values_mut().filter_map(|followed| followed.body.take()).collect();
        if self.waiting.must_wait(&input.found) {
            self.waiting.push(id, input, carried);
            let mut report = FrameReport::waiting(id, input.frame.timestamp());
            report.released = released;
            return Ok(report);
        }
        let mut report = self.process(id, input, &carried)?;
        report.released.append(&mut released);
        Ok(report)
    }

    /// Gives an id to a frame or scan whose time was [checked](Self::check_time), and processes the frames
    /// that have waited long enough.
    pub(crate) fn begin_input(
        &mut self,
        timestamp: f64,
        world_from_camera: &Pose,
    ) -> Result<(FrameId, Vec<FrameReport>), Error> {
        let past = &mut self.map.past;
        let id = past.next_frame();
        let is_first_of_session = self.clock.is_new();
        let clock_offset = self.clock.advance(timestamp, past.newest);
        past.newest = timestamp + clock_offset;
        if let Some(log) = &mut past.log {
            if is_first_of_session {
                log.sessions.push(Session { first: id, start: past.newest, content: 0 });
            }
            log.frames.push(InsertedFrame { timestamp, clock_offset, world_from_camera: *world_from_camera });
        }
        self.waiting.give_up_before((id, timestamp), self.config.max_detection_delay);
        Ok((id, self.process_ready()?))
    }

    /// Brings the detections of a frame that was inserted with [`Detections::Pending`], and processes it and
    /// the frames behind it that need not wait any longer. Returns the report of that frame; it still waits
    /// where an older frame does.
    ///
    /// With a [history](MapConfig::history), detections may also come for a key frame that was already mapped
    /// without them: its movers are then taken out of the maps, which costs what
    /// [`correct_poses`](Self::correct_poses) does from that frame on.
    ///
    /// # Errors
    ///
    /// [`Error::NotPending`] when the frame awaits no detections, nor was mapped without them;
    /// [`Error::Dynamics`] when an instance mask is of another size than the frame; [`Error::History`] when
    /// what the frame showed cannot be read. The builder stays as it was.
    pub fn detections_for(&mut self, frame: FrameId, found: &[Detection]) -> Result<FrameReport, Error> {
        let Ok(waiting) = self.waiting.pending(frame) else { return self.mend(frame, found) };
        Preprocessor::check(&waiting.frame, found)?;
        let report = FrameReport::waiting(frame, waiting.frame.timestamp());
        self.waiting.resolve(frame, found);
        let mut released = self.process_ready()?;
        let own = released.iter().position(|report| report.id == frame).map(|index| released.remove(index));
        let mut report = own.unwrap_or(report);
        report.released = released;
        Ok(report)
    }

    /// Processes all frames that wait, those without detections as frames on which the detector did not run.
    ///
    /// # Errors
    ///
    /// None is expected: what can be refused was refused when the frame was inserted.
    pub fn process_waiting(&mut self) -> Result<Vec<FrameReport>, Error> {
        self.waiting.give_up();
        self.process_ready()
    }

    pub(crate) fn process_ready(&mut self) -> Result<Vec<FrameReport>, Error> {
        while let Some(ready) = self.waiting.pop_ready() {
            // After an error, the next call gives the reports of the frames before it.
            let report = self.process(ready.id, &ready.input(), &ready.carried)?;
            self.released.push(report);
            // A frame that has waited must not be lost on a full disk: the next frame that is inserted tells of
            // that, before anything has changed.
            self.pager.page_out(&mut self.map, &mut self.snapshots).ok();
        }
        Ok(std::mem::take(&mut self.released))
    }

    /// Everything that can be refused is refused here, before anything changes.
    fn check(&self, input: &FrameInput<'_>) -> Result<(), Error> {
        self.check_time(input.frame.timestamp())?;
        Preprocessor::check(input.frame, input.detections().unwrap_or(&[]))?;
        input.frame.camera().subsampled(self.config.sensor.stride)?;
        self.check_pose(input.frame, &input.world_from_camera)
    }

    /// Checks that the maps reach as far as a frame's readings.
    pub(crate) fn check_pose(&self, frame: &Frame, world_from_camera: &Pose) -> Result<(), Error> {
        let sensor = &self.config.sensor;
        // What is inserted is counted: with a stride, each reading stands for several.
        if self.map.cloud.maps_every_view(&frame.camera().subsampled(sensor.stride)?) {
            self.map.check_reach(frame, world_from_camera)?;
        } else {
            let mut inserted = frame.subsampled(sensor.stride)?;
            inserted.average_range_end(sensor, &mut Vec::new());
            self.map.check_reach(&inserted, world_from_camera)?;
        }
        Ok(self.map.octree.check_depth(frame, &self.config.sensor, world_from_camera)?)
    }

    /// Checks that time goes on, in seconds, on the session's clock and on that of the maps.
    pub(crate) fn check_time(&self, timestamp: f64) -> Result<(), Error> {
        let previous = self.clock.newest();
        if timestamp < previous {
            return Err(dymlm_dynamics::Error::TimeReversed { previous, timestamp }.into());
        }
        check_timestamp(timestamp)?;
        Ok(check_timestamp(timestamp + self.clock.offset_at(timestamp, self.map.past.newest))?)
    }

    /// The paper's figure 2, one step a line. `carried`: boxes of carried objects, with a rim, in the world.
    fn process(
        &mut self,
        id: FrameId,
        input: &FrameInput<'_>,
        carried: &[OrientedBox],
    ) -> Result<FrameReport, Error> {
        let Self {
            config,
            preprocessor,
            plane_detector,
            key_frames,
            subsampler,
            processed,
            snapshots,
            map,
            publisher,
            ..
        } = self;
        let timestamp = input.frame.timestamp();
        let input = subsampler.bring_in(input, self.clock.offset())?;
        let (frame, found, pose) = (input.frame, input.detections(), &input.world_from_camera);
        let mut clock = StageClock::start();

        let free_space = |place, margin| map.cloud.is_long_free(place, margin);
        let knowledge = SceneKnowledge::default().with_carried(carried).with_free_space(&free_space);
        clock.time(Stage::Dynamics, || {
            preprocessor.process_knowing(frame, found, pose, &knowledge).map(|_| ())
        })?;
        *processed = Some(id);
        let (movers, static_mask) = (preprocessor.movers(), preprocessor.static_mask());
        let viewed = Viewed { timestamp: frame.timestamp(), world_from_camera: *pose };
        let outcome = if key_frames.choose(viewed, found.is_some()) {
            let boxes: Vec<_> = movers.iter().map(|mover| mover.corrected_box).collect();
            let view = KeyFrameView {
                frame,
                static_mask,
                mover_mask: preprocessor.mover_mask(),
                unproven_mask: preprocessor.unproven_mask(),
                detections: found,
                sighted_points: input.sighted_points,
                planes: &[],
            };
            let context =
                MappingContext { sensor: &config.sensor, mover_labels: preprocessor.mover_labels() };
            // The observation that is kept is also what is mapped, so that mapping it again gives the same bits.
            let log = map.past.log.as_mut();
            let to_keep =
                |log: &mut SessionLog| clock.time(Stage::History, || view.to_observation(&mut log.history));
            let kept = log.map(to_keep).transpose()?;
            let mapped = kept.as_ref().map_or(view, KeyFrameView::of);
            let mut update = mapped.map(map, pose, &context, &mut clock, || {
                Ok(plane_detector.detect(frame, Some(static_mask), &boxes)?)
            })?;
            if let Some(mut kept) = kept {
                kept.planes = plane_detector.planes().to_vec();
                note_key_frame(id, Arc::new(kept), &update, map, snapshots);
            }
            map.change();
            clock.time(Stage::Publishing, || {
                publisher.publish_when_due(frame.timestamp(), config.publish_interval, map);
            });
            update.planes.rejected = plane_detector.rejected().to_vec();
            FrameOutcome::Mapped(Box::new(update))
        } else {
            FrameOutcome::Tracked
        };
        Ok(FrameReport {
            id,
            timestamp,
            outcome,
            movers: in_all_pixels(movers, config.sensor.stride),
            masked_pixels: masked_in_all_pixels(static_mask, config.sensor.stride),
            stages: clock.finish(),
            released: Vec::new(),
        })
    }

    /// Removes from octree, planes and objects what the evidence of the newest frames has found to be no part
    /// of the static world. The builder does so by itself once a second of the frames' clock; the cloud is
    /// always up to date. Readers get the maps as they are then. When no evidence has changed since the last
    /// removal, nothing is removed.
    pub fn settle(&mut self) {
        if self.map.is_settled() {
            // Frames that no map has seen have ids and poses, too: who saves what is newer shall save them.
            if self.publisher.lacks_frames_of(&self.map) {
                self.map.change();
            }
            self.publisher.publish(&mut self.map);
            return;
        }
        self.map.remove_ghosts();
        self.note(Some(Event::Settled));
        self.publish_change();
    }

    /// Logs an event, when a history is kept.
    pub(crate) fn note(&mut self, event: Option<Event>) {
        if let Some((log, event)) = self.map.past.log.as_mut().zip(event) {
            log.events.push(event);
        }
    }

    /// The newest frame or scan in the log, and its pose.
    pub(crate) fn newest_mapped(&self) -> Option<(FrameId, Pose)> {
        self.map.past.log.as_ref()?.newest()
    }

    /// Forgets everything that is farther than `radius` metres from a place (world), in all maps: for robots
    /// that need only their surroundings. What is nearer stays as it is. Goes through all blocks held, and
    /// through what every key frame has seen of planes: calling it once every few metres is enough. Where the
    /// place or the radius is no number, nothing is forgotten.
    pub fn forget_outside(&mut self, mut center: [f64; 3], radius: f64) {
        if radius.is_nan() || !center.iter().all(|c| c.is_finite()) {
            return;
        }
        if let Some((newest, world_from_camera)) = self.newest_mapped() {
            let in_camera = world_from_camera.inverse().transform_point(center);
            center = world_from_camera.transform_point(in_camera);
            self.note(Some(Event::Forgot { newest, center: in_camera, radius }));
        }
        self.map.forget_outside(center, radius);
        self.publish_change();
    }

    /// A reader of the maps for other threads. It sees the maps as they are now, and then as they are
    /// published: every [`publish_interval`](MapConfig::publish_interval), and at once after
    /// [`settle`](Self::settle), [`forget_outside`](Self::forget_outside), a moved object or a correction of
    /// poses.
    ///
    /// Publishing costs some nanoseconds for each block of the cloud, a copy of the other maps, and later one
    /// copy of each block that a frame changes. It costs nothing while nobody has a reader.
    pub fn reader(&mut self) -> MapReader {
        self.publisher.reader(&mut self.map)
    }

    /// Publishes a change that was made on request.
    pub(crate) fn publish_change(&mut self) {
        self.map.change();
        self.publisher.publish(&mut self.map);
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

    /// Ends the builder and returns the maps. Frames that wait for detections are not in them: see
    /// [`process_waiting`](Self::process_waiting).
    pub fn into_map(mut self) -> MultiLevelMap {
        self.settle();
        self.map
    }
}

/// Logs a key frame that has been mapped, in maps with a history.
fn note_key_frame(
    id: FrameId,
    kept: Arc<Observation>,
    update: &MapUpdate,
    map: &mut MultiLevelMap,
    snapshots: &mut Snapshots,
) {
    if let Some(log) = &mut map.past.log {
        log.add_key_frame(id, kept, update);
    }
    if let Some(log) = &map.past.log {
        snapshots.take_when_due(map, &log.events);
    }
}

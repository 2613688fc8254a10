use dymlm_core::{BoundingBox, Detection, Frame, Mask, PinholeCamera, Pose, SensorModel};

use crate::miss_compensation::{gone_since_detected, is_still_there};
use crate::mover_labels::mover_labels;
use crate::tracking::LOW_SCORE;
use crate::unlabelled::Cutting;
use crate::{
    BoxCorrector, BoxSource, BoxTracker, ComparedFrame, DynamicsConfig, Error, Foreground, ForegroundFinder,
    ForegroundSearch, FreeSpace, MaskRegion, Mover, PastViews, SceneKnowledge, StaticMaskBuilder, TrackedBox,
    UnlabelledFinder, View, mask_body,
};

/// All steps of paper section III-A up to the point cloud: from a frame and its detections to the movers'
/// corrected boxes and the mask of static pixels.
///
/// Buffers are reused: after the first frames nothing large is allocated.
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
/// use dymlm_dynamics::{DynamicsConfig, Preprocessor};
///
/// // Somebody at 2 m, before a wall at 3 m; the detector's box is too narrow.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let frame = Frame::new(0.0, camera, DepthImage::new(160, 120, depth)?, None)?;
/// let detection = Detection::new("person", 0.8, BoundingBox::new(65.0, 0.0, 110.0, 120.0)?)?;
///
/// let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect())?;
/// let result = preprocessor.process(&frame, Some(&[detection]), &Pose::identity())?;
/// assert_eq!(result.movers[0].corrected_box, BoundingBox::new(60.0, 0.0, 110.0, 120.0)?);
/// assert!(!result.static_mask.at(61, 60) && result.static_mask.at(106, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Preprocessor {
    sensor: SensorModel,
    mover_labels: Vec<String>,
    tracker: BoxTracker,
    finder: ForegroundFinder,
    corrector: BoxCorrector,
    mask_builder: StaticMaskBuilder,
    past_views: PastViews,
    unlabelled: UnlabelledFinder,
    movers: Vec<Mover>,
    /// The pixels in the movers' boxes.
    boxes: Mask,
    /// The pixels in the detected boxes of things that are no movers.
    claimed: Mask,
    /// Time since each predicted mover was last detected, seconds; a buffer.
    missed: Vec<f64>,
    /// The foreground of each mover, followed by buffers for later frames.
    foregrounds: Vec<Foreground>,
    static_mask: Mask,
    mover_mask: Mask,
    unproven_mask: Mask,
}

/// What [`Preprocessor::process`] found in a frame.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Preprocessed<'a> {
    /// The potential movers, by ascending track id; those without a label come last.
    pub movers: &'a [Mover],
    /// `true` = static, `false` = inside a mover; has the frame's size.
    pub static_mask: &'a Mask,
}

impl Preprocessor {
    /// Most detections of a frame; detections of a score below 0.1 are ignored and do not count. Ultralytics'
    /// YOLO gives at most as many (`max_det`), and fewer things have room before a depth camera. The cost of
    /// a detection grows with its box; one that fills a 640x480 image costs some milliseconds.
    pub const MAX_DETECTIONS: usize = 300;

    /// Makes a preprocessor that has seen no frame.
    ///
    /// # Errors
    ///
    /// [`Error::Config`] names the field outside its range; [`Error::UnknownLabel`].
    pub fn new(config: DynamicsConfig, sensor: SensorModel) -> Result<Self, Error> {
        sensor.validate()?;
        config.validate()?;
        Ok(Self {
            sensor,
            mover_labels: mover_labels(&config)?,
            unlabelled: UnlabelledFinder::new(config.tracker.clone(), sensor)?,
            tracker: BoxTracker::new(config.tracker)?,
            finder: ForegroundFinder::new(&sensor)?,
            corrector: BoxCorrector::new(config.max_extension),
            mask_builder: StaticMaskBuilder::new(config.mask),
            past_views: PastViews::default(),
            movers: Vec::new(),
            boxes: Mask::filled(1, 1, false)?,
            claimed: Mask::filled(1, 1, false)?,
            missed: Vec::new(),
            foregrounds: Vec::new(),
            static_mask: Mask::filled(1, 1, true)?,
            mover_mask: Mask::filled(1, 1, false)?,
            unproven_mask: Mask::filled(1, 1, false)?,
        })
    }

    /// Checks whether [`Self::process`] would accept the detections of a frame; timestamps are not checked.
    ///
    /// # Errors
    ///
    /// [`Error::InstanceMaskSize`], [`Error::TooManyDetections`].
    pub fn check(frame: &Frame, detections: &[Detection]) -> Result<(), Error> {
        let given = detections.iter().filter(|detection| detection.score() >= LOW_SCORE).count();
        if given > Self::MAX_DETECTIONS {
            return Err(Error::TooManyDetections { given, max: Self::MAX_DETECTIONS });
        }
        check_instance_masks(frame, detections)
    }

    /// Preprocesses one frame.
    ///
    /// `detections` is `None` when the detector did not run on this frame, which says nothing about who is in
    /// it: tracks are predicted, and none counts as missed. An empty slice means that the detector ran and
    /// found nobody.
    ///
    /// # Errors
    ///
    /// [`Error::InstanceMaskSize`], [`Error::TooManyDetections`], [`Error::Timestamp`],
    /// [`Error::TimeReversed`]; a refused frame changes nothing.
    pub fn process(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
    ) -> Result<Preprocessed<'_>, Error> {
        self.process_knowing(frame, detections, world_from_camera, &SceneKnowledge::default())
    }

    /// [`Self::process`] with knowledge of the scene from other sources.
    ///
    /// # Errors
    ///
    /// As [`Self::process`].
    pub fn process_knowing(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
        knowledge: &SceneKnowledge<'_>,
    ) -> Result<Preprocessed<'_>, Error> {
        let found = detections.unwrap_or(&[]);
        Self::check(frame, found)?;
        self.tracker.check_time(frame.timestamp())?;
        self.past_views.forget_old(frame.timestamp());
        self.track(frame, detections, world_from_camera)?;
        self.find_foregrounds(frame, found, world_from_camera)?;
        self.remember_depths();
        self.compensate_misses();
        self.correct_boxes(frame);
        self.find_claimed(frame, found)?;
        self.mask_movers(frame, found, world_from_camera);
        self.past_views.remember(frame, world_from_camera, &self.sensor);
        for body in knowledge.carried() {
            mask_body(frame, &body.transformed(&world_from_camera.inverse()), &mut self.static_mask);
        }
        self.mask_unlabelled(frame, world_from_camera, knowledge.free_space())?;
        Ok(Preprocessed { movers: &self.movers, static_mask: &self.static_mask })
    }

    /// Tracks the boxes of potential movers. All of them become movers: detected ones, confirmed or not, and
    /// predicted ones.
    fn track(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let view = View { camera: *frame.camera(), world_from_camera: *world_from_camera };
        let is_mover = |detection: &Detection| is_mover(&self.mover_labels, detection);
        let boxes = match detections {
            Some(detections) => {
                self.tracker.update_where(frame.timestamp(), detections, Some(&view), is_mover)?
            }
            None => self.tracker.predict(frame.timestamp(), Some(&view))?,
        };
        // When there are more predicted boxes than room, those missed for longest are left out; among those
        // missed for equally long, the newest.
        let missed_for = |tracked: &TrackedBox| match tracked.source {
            BoxSource::Predicted { missed_for } => Some(missed_for),
            BoxSource::Detected { .. } | BoxSource::FreeSpace => None,
        };
        self.missed.clear();
        self.missed.extend(boxes.iter().filter_map(missed_for));
        let room = Self::MAX_DETECTIONS.saturating_sub(boxes.len() - self.missed.len());
        self.missed.sort_unstable_by(f64::total_cmp);
        let too_long = self.missed.get(room).copied().unwrap_or(f64::INFINITY);
        let mut room = room - self.missed.partition_point(|&missed| missed < too_long).min(room);
        let kept = boxes.iter().filter(|tracked| match missed_for(tracked) {
            Some(missed) if missed >= too_long => {
                let is_kept = room > 0;
                room = room.saturating_sub(1);
                is_kept
            }
            _ => true,
        });
        self.movers.clear();
        self.movers.extend(kept.map(Mover::of_track));
        Ok(())
    }

    /// Finds the foreground in each mover's box.
    fn find_foregrounds(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        if self.movers.is_empty() {
            return Ok(());
        }
        self.boxes.refill(frame.camera().width(), frame.camera().height(), false)?;
        for mover in &self.movers {
            self.boxes.fill_box(&mover.bounding_box, true);
        }
        self.past_views.measure_misfits(frame, world_from_camera, &self.boxes, &self.sensor);
        let compared =
            ComparedFrame { frame, world_from_camera, past: &self.past_views, sensor: &self.sensor };
        self.foregrounds.resize_with(self.movers.len().max(self.foregrounds.len()), Foreground::default);
        for (own, foreground) in self.foregrounds.iter_mut().enumerate().take(self.movers.len()) {
            let instance_mask = instance_mask(&self.movers[own], detections);
            let search = ForegroundSearch { mover: &self.movers[own], boxes: &self.boxes, instance_mask };
            self.finder.find(&compared, &search, foreground);
        }
        Ok(())
    }

    /// Gives the movers' depths to the tracker. Only a detection proves that the mover is in its box; and a
    /// mover occluded by another one is still at the depth at which it was seen before.
    fn remember_depths(&mut self) {
        for (own, mover) in self.movers.iter().enumerate() {
            if let (BoxSource::Detected { .. }, Some(depth)) = (mover.source, self.foregrounds[own].depth())
                && (mover.depth.is_none() || !self.belongs_to_another(own))
            {
                self.tracker.observe_depth(mover.track_id, depth);
            }
        }
    }

    /// Whether a mover's foreground more likely belongs to another mover.
    fn belongs_to_another(&self, own: usize) -> bool {
        let mine = &self.foregrounds[own];
        self.foregrounds.iter().take(self.movers.len()).enumerate().any(|(other, theirs)| {
            (theirs.likelihood(), own) > (mine.likelihood(), other) && mine.is_mostly_on(theirs)
        })
    }

    /// Drops predicted movers whose box does not hold them, and moves the boxes of the other predicted movers
    /// to the foreground that was found.
    fn compensate_misses(&mut self) {
        let mut kept = 0;
        for index in 0..self.movers.len() {
            let Some(foreground) = self.foregrounds.get(index) else { break };
            let mover = &mut self.movers[index];
            if let BoxSource::Predicted { missed_for } = mover.source
                && !is_still_there(foreground, mover.depth, missed_for, &self.sensor)
            {
                continue;
            }
            if matches!(mover.source, BoxSource::Predicted { .. })
                && let Some(found) = foreground.bounding_box()
            {
                // The predicted box is a guess, the foreground is measured.
                mover.bounding_box = found;
            }
            mover.depth = foreground.depth();
            self.movers.swap(kept, index);
            self.foregrounds.swap(kept, index);
            kept += 1;
        }
        self.movers.truncate(kept);
    }

    /// Widens boxes that cut their mover short.
    fn correct_boxes(&mut self, frame: &Frame) {
        for (mover, foreground) in self.movers.iter_mut().zip(&self.foregrounds) {
            mover.corrected_box = self.corrector.correct(frame, &mover.bounding_box, foreground);
        }
    }

    /// Finds the pixels that detections of things claim which are no movers.
    fn find_claimed(&mut self, frame: &Frame, detections: &[Detection]) -> Result<(), Error> {
        if self.movers.is_empty() {
            return Ok(());
        }
        self.claimed.refill(frame.camera().width(), frame.camera().height(), false)?;
        let is_thing = |detection: &&Detection| {
            detection.score() >= LOW_SCORE && !is_mover(&self.mover_labels, detection)
        };
        for thing in detections.iter().filter(is_thing) {
            self.claimed.fill_box(&thing.bounding_box(), true);
        }
        Ok(())
    }

    /// Builds the masks of static pixels and of movers.
    fn mask_movers(&mut self, frame: &Frame, detections: &[Detection], world_from_camera: &Pose) {
        let compared =
            ComparedFrame { frame, world_from_camera, past: &self.past_views, sensor: &self.sensor };
        let regions = self.movers.iter().zip(&self.foregrounds).map(|(mover, foreground)| MaskRegion {
            bounding_box: mover.corrected_box,
            sure_box: sure_box(mover, &self.tracker, frame.camera()),
            foreground,
            instance_mask: instance_mask(mover, detections),
        });
        let masks = [&mut self.static_mask, &mut self.mover_mask];
        self.mask_builder.build(regions, &self.claimed, &compared, masks);
    }

    /// Masks new readings in space that was free for long.
    fn mask_unlabelled(
        &mut self,
        frame: &Frame,
        world_from_camera: &Pose,
        free_space: Option<&dyn FreeSpace>,
    ) -> Result<(), Error> {
        self.unproven_mask.refill(frame.camera().width(), frame.camera().height(), false)?;
        let Some(free_space) = free_space else { return Ok(()) };
        // `unite` instead of a clone, because a clone allocates.
        self.unproven_mask.unite(&self.static_mask)?;
        let mut cutting = Cutting {
            finder: &mut self.finder,
            corrector: &mut self.corrector,
            mask_builder: &mut self.mask_builder,
        };
        // When poses drift, the map's free space no longer fits the present place, and all walls seem new. So
        // a place counts as free only when a frame of the last half minute has looked through it.
        let (past_views, sensor) = (&self.past_views, &self.sensor);
        let was_free = |place, margin| {
            free_space.is_long_free(place, margin) && past_views.have_looked_through(place, sensor)
        };
        self.unlabelled.mask(frame, world_from_camera, &was_free, &mut cutting, &mut self.static_mask)?;
        self.unproven_mask.subtract(&self.static_mask)?;
        self.unlabelled.track(frame, world_from_camera, &mut self.tracker, &mut self.movers)
    }

    /// Converts all stored poses after the world frame was moved; poses of later frames are in the new frame.
    pub fn move_world(&mut self, new_from_old: &Pose) {
        self.tracker.move_world(new_from_old);
        self.unlabelled.move_world(new_from_old);
        self.past_views.move_world(new_from_old);
    }

    /// The movers of the last frame, by ascending track id; those without a label come last.
    pub fn movers(&self) -> &[Mover] {
        &self.movers
    }

    /// All labels of potential movers.
    pub fn mover_labels(&self) -> &[String] {
        &self.mover_labels
    }

    /// The mask of the last frame: `true` = static. A single pixel before the first frame.
    pub fn static_mask(&self) -> &Mask {
        &self.static_mask
    }

    /// The pixels of the last frame that are surely a mover's (`true`): silhouettes without a rim, within
    /// detected boxes, or, when the detector did not run, within predicted ones. Pixels that are neither in
    /// this mask nor static may be either. A single pixel before the first frame.
    pub fn mover_mask(&self) -> &Mask {
        &self.mover_mask
    }

    /// The pixels of the last frame (`true`) that are not static because they are new readings in free space:
    /// a mover, or something that has just been put there. A single pixel before the first frame.
    pub fn unproven_mask(&self) -> &Mask {
        &self.unproven_mask
    }
}

/// The box in which a mover surely is: as detected, or as predicted until the detector runs again, and as long
/// as the mover cannot have left it. After the detector has run and not found the mover, none is sure.
fn sure_box(mover: &Mover, tracker: &BoxTracker, camera: &PinholeCamera) -> Option<BoundingBox> {
    let tracked = tracker.boxes().iter().find(|tracked| tracked.track_id == mover.track_id)?;
    let own = tracked.bounding_box;
    let gone = gone_since_detected(mover, camera)?;
    (!tracker.has_missed(mover.track_id) && gone <= own.width().min(own.height())).then_some(own)
}

/// Whether a detection has the label of a potential mover.
fn is_mover(mover_labels: &[String], detection: &Detection) -> bool {
    mover_labels.iter().any(|own| own == detection.label())
}

fn check_instance_masks(frame: &Frame, detections: &[Detection]) -> Result<(), Error> {
    let (width, height) = (frame.camera().width(), frame.camera().height());
    for (detection, mask) in detections.iter().enumerate().filter_map(|(i, d)| d.mask().map(|mask| (i, mask)))
    {
        let (actual_width, actual_height) = (mask.width(), mask.height());
        if (actual_width, actual_height) != (width, height) {
            return Err(Error::InstanceMaskSize { detection, width, height, actual_width, actual_height });
        }
    }
    Ok(())
}

fn instance_mask<'a>(mover: &Mover, detections: &'a [Detection]) -> Option<&'a Mask> {
    match mover.source {
        BoxSource::Detected { detection } => detections.get(detection).and_then(Detection::mask),
        BoxSource::Predicted { .. } | BoxSource::FreeSpace => None,
    }
}

use dymlm_core::{Detection, Frame, Mask, Pose};
use dymlm_geometry::OrientedBox;

use crate::{
    BoxCorrector, BoxSource, BoxTracker, DynamicsConfig, Error, Foreground, ForegroundFinder,
    ForegroundSearch, MaskRegion, MissCompensator, Mover, StaticMaskBuilder, View, mask_body,
};

/// All of paper section III-A up to the point cloud: from a frame and its detections to the movers' corrected boxes
/// and the mask of static pixels.
///
/// [`Self::process`] runs the steps in order; each is also public, in the same order, so that a caller can time them.
/// Buffers are kept: after the first frames nothing large is allocated.
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose};
/// use dymlm_dynamics::{DynamicsConfig, Preprocessor};
///
/// // Somebody at 2 m, before a wall at 3 m; the detector's box is too narrow.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let frame = Frame::new(0.0, camera, DepthImage::new(160, 120, depth)?, None)?;
/// let detection = Detection::new("person", 0.8, BoundingBox::new(65.0, 0.0, 110.0, 120.0)?)?;
///
/// let mut preprocessor = Preprocessor::new(DynamicsConfig::default())?;
/// let result = preprocessor.process(&frame, &[detection], &Pose::identity())?;
/// assert_eq!(result.movers[0].corrected_box, BoundingBox::new(60.0, 0.0, 110.0, 120.0)?);
/// assert!(!result.static_mask.at(61, 60) && result.static_mask.at(106, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Preprocessor {
    mover_labels: Vec<String>,
    tracker: BoxTracker,
    finder: ForegroundFinder,
    compensator: MissCompensator,
    corrector: BoxCorrector,
    mask_builder: StaticMaskBuilder,
    movers: Vec<Mover>,
    /// The foreground of each mover; behind them, buffers for later frames.
    foregrounds: Vec<Foreground>,
    static_mask: Mask,
}

/// What [`Preprocessor::process`] found in a frame.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Preprocessed<'a> {
    /// The potential movers, by ascending track id.
    pub movers: &'a [Mover],
    /// `true` = static, `false` = inside a mover; of the frame's size.
    pub static_mask: &'a Mask,
}

impl Preprocessor {
    /// Makes a preprocessor that has seen nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: DynamicsConfig) -> Result<Self, Error> {
        Ok(Self {
            mover_labels: config.mover_labels,
            tracker: BoxTracker::new(config.tracker)?,
            finder: ForegroundFinder::new(config.foreground)?,
            compensator: MissCompensator::new(config.compensation)?,
            corrector: BoxCorrector::new(config.correction)?,
            mask_builder: StaticMaskBuilder::new(config.mask)?,
            movers: Vec::new(),
            foregrounds: Vec::new(),
            static_mask: Mask::filled(1, 1, true)?,
        })
    }

    /// Asks whether a frame and its detections would be taken, and changes nothing.
    ///
    /// # Errors
    ///
    /// As [`Self::process`].
    pub fn check(&self, frame: &Frame, detections: &[Detection]) -> Result<(), Error> {
        check_instance_masks(frame, detections)?;
        self.tracker.check_time(frame.timestamp()).map(|_| ())
    }

    /// Preprocesses one frame.
    ///
    /// # Errors
    ///
    /// As [`Self::track`]; the preprocessor stays as it was.
    pub fn process(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<Preprocessed<'_>, Error> {
        self.track(frame, detections, world_from_camera)?;
        self.find_foregrounds(frame, detections);
        self.compensate_misses();
        self.correct_boxes(frame);
        self.mask_movers(frame, detections);
        Ok(Preprocessed { movers: &self.movers, static_mask: &self.static_mask })
    }

    /// Step 1: tracks the boxes of potential movers. All of them become movers: detected ones, confirmed or not, and
    /// predicted ones.
    ///
    /// # Errors
    ///
    /// [`Error::InstanceMaskSize`], [`Error::Timestamp`], [`Error::TimeReversed`]; nothing has changed.
    pub fn track(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        check_instance_masks(frame, detections)?;
        let view = View { camera: *frame.camera(), world_from_camera: *world_from_camera };
        let boxes = self.tracker.update_where(frame.timestamp(), detections, Some(&view), |detection| {
            self.mover_labels.iter().any(|label| label == detection.label())
        })?;
        self.movers.clear();
        self.movers.extend(boxes.iter().map(|tracked| Mover {
            track_id: tracked.track_id,
            label: tracked.label.clone(),
            score: tracked.score,
            source: tracked.source,
            state: tracked.state,
            bounding_box: tracked.bounding_box,
            corrected_box: tracked.bounding_box,
            depth: tracked.expected_depth,
        }));
        Ok(())
    }

    /// Step 2: finds the foreground in each mover's box.
    pub fn find_foregrounds(&mut self, frame: &Frame, detections: &[Detection]) {
        while self.foregrounds.len() < self.movers.len() {
            self.foregrounds.push(Foreground::new());
        }
        for (mover, foreground) in self.movers.iter().zip(&mut self.foregrounds) {
            let mut search = ForegroundSearch::new(mover.bounding_box);
            search.instance_mask = instance_mask(mover, detections);
            search.expected_depth = mover.depth;
            self.finder.find(frame.camera(), frame.depth(), &search, foreground);
        }
    }

    /// Step 3: drops predicted movers whose box does not hold them, and remembers the depth of all others.
    pub fn compensate_misses(&mut self) {
        let mut kept = 0;
        for index in 0..self.movers.len() {
            let Some(foreground) = self.foregrounds.get(index) else { break };
            let mover = &mut self.movers[index];
            if let BoxSource::Predicted { missed_for } = mover.source
                && !self.compensator.is_still_there(foreground, mover.depth, missed_for)
            {
                continue;
            }
            mover.depth = foreground.depth();
            // Only a detection vouches for what is in the box.
            if let (BoxSource::Detected { .. }, Some(depth)) = (mover.source, mover.depth) {
                self.tracker.observe_depth(mover.track_id, depth);
            }
            self.movers.swap(kept, index);
            self.foregrounds.swap(kept, index);
            kept += 1;
        }
        self.movers.truncate(kept);
    }

    /// Step 4: widens boxes that cut their mover short.
    pub fn correct_boxes(&mut self, frame: &Frame) {
        for (mover, foreground) in self.movers.iter_mut().zip(&self.foregrounds) {
            mover.corrected_box = self.corrector.correct(frame.depth(), &mover.bounding_box, foreground);
        }
    }

    /// Step 5: builds the mask of static pixels.
    pub fn mask_movers(&mut self, frame: &Frame, detections: &[Detection]) {
        let regions = self.movers.iter().zip(&self.foregrounds).map(|(mover, foreground)| MaskRegion {
            bounding_box: mover.corrected_box,
            foreground,
            instance_mask: instance_mask(mover, detections),
        });
        self.mask_builder.build(regions, frame.depth(), &mut self.static_mask);
    }

    /// After step 5: masks a body that moves and whose place is known by other means, given in the camera's frame.
    pub fn mask_body(&mut self, frame: &Frame, camera_from_body: &OrientedBox) {
        mask_body(frame, camera_from_body, &mut self.static_mask);
    }

    /// The movers of the last frame, by ascending track id.
    pub fn movers(&self) -> &[Mover] {
        &self.movers
    }

    /// The mask of the last frame: `true` = static. A single pixel before the first frame.
    pub fn static_mask(&self) -> &Mask {
        &self.static_mask
    }
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
        BoxSource::Predicted { .. } => None,
    }
}

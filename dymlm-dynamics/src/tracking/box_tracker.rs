use std::cmp::Ordering;
use std::sync::Arc;

use dymlm_core::{BoundingBox, Detection, Pose, TrackId};
use dymlm_geometry::Assignment;

use super::assignment::pair_by_iou;
use super::ego_motion::{self, Reprojection};
use super::{BoxKalman, BoxSource, TrackState, TrackedBox, TrackerConfig, View};
use crate::{Error, check_timestamp};

/// Detections of a lower score are ignored (`ByteTrack`).
pub(crate) const LOW_SCORE: f32 = 0.1;
/// Most tracks that are remembered: three times the number of things that a detector sees at once or within
/// the time after which a track is forgotten. Each track costs as much as a detection.
const MAX_TRACKS: usize = 1000;
/// How long a detector's looks keep a track remembered at most, seconds, and how long it is while only one look
/// has been and nobody knows its pace. A higher value gives whoever stands there later an old id, a lower one
/// gives who stays a new id at each look of a slow detector.
const LONGEST_MEMORY: f64 = 60.0;
/// Time since the last detection after which a predicted box is no longer output, unless it may coast for
/// longer, seconds: at an indoor walking speed of 0.7 m/s somebody may be 3.5 m away by then, and any foreground
/// in the box would be taken for them. A lower value maps who sits still between the looks of a slow detector.
const LONGEST_PREDICTION: f64 = 5.0;
/// Allowance for rounded timestamps, seconds: three frames at 6 Hz count as half a second.
const TIME_SLACK: f64 = 1e-3;

/// Tracks the boxes of a 2D detector from frame to frame, label by label.
///
/// SORT (Bewley, Ge, Ott, Ramos, Upcroft: "Simple Online and Realtime Tracking", ICIP 2016): each track's box
/// is predicted by a [`BoxKalman`] and paired with the frame's detections so that the sum of the
/// intersections over union is greatest. The tracker adds:
/// - a second association, of the unmatched tracks with the weak detections (Zhang et al.: "`ByteTrack`:
///   Multi-Object Tracking by Associating Every Detection Box", ECCV 2022), because a weak box often is the
///   missed person;
/// - true time steps instead of frame counts;
/// - ego-motion compensation, when the camera's [`View`] is given: a track is first re-projected from the
///   previous image as if it stood still, at the depth given to [`Self::observe_depth`] (without a depth only
///   the camera's rotation is undone);
/// - a third association, of the remaining tracks and strong detections, by how far a person may have walked
///   since the detector last ran: at one frame per second boxes do not overlap;
/// - output of unmatched tracks, for a while, as [`BoxSource::Predicted`].
///
/// A frame of n tracks and m detections costs O(n m), and O((n + m)^3) among boxes that compete. At most a
/// thousand tracks, or the number of the last frame's detections if that is larger, are remembered: those
/// seen last. The order of the detections does not matter. Empty boxes are ignored.
///
/// ```
/// use dymlm_core::{BoundingBox, Detection};
/// use dymlm_dynamics::{BoxSource, BoxTracker, TrackerConfig};
///
/// let mut tracker = BoxTracker::new(TrackerConfig::default())?;
/// let person = |x: f32| Detection::new("person", 0.9, BoundingBox::new(x, 0.0, x + 50.0, 200.0)?);
/// for frame in 0_u8..5 {
///     let detections = [person(f32::from(frame) * 4.0)?];
///     let boxes = tracker.update(f64::from(frame) / 30.0, &detections, None)?;
///     assert_eq!(boxes[0].track_id.get(), 0);
/// }
/// // The detector misses the person: the track continues by prediction.
/// let boxes = tracker.update(5.0 / 30.0, &[], None)?;
/// assert!(matches!(boxes[0].source, BoxSource::Predicted { .. }));
/// assert!((boxes[0].bounding_box.x_min() - 20.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BoxTracker {
    config: TrackerConfig,
    tracks: Vec<Track>,
    next_id: u64,
    last_timestamp: Option<f64>,
    /// Time of the last frame on which the detector ran.
    last_look: f64,
    /// Seconds between the last frames on which it ran, the newest first; infinite before there are any.
    look_intervals: [f64; 2],
    last_view: Option<View>,
    boxes: Vec<TrackedBox>,
    scratch: Scratch,
}

#[derive(Debug, Clone)]
struct Track {
    id: TrackId,
    label: Arc<str>,
    filter: BoxKalman,
    /// The area of the filter's box and the sides of the detected one when it was seen last, as the camera would
    /// see them from where it is now, pixels.
    seen_area: f64,
    seen_size: [f64; 2],
    /// How far the image has turned since then, radians.
    roll: f64,
    score: f32,
    first_seen: f64,
    last_seen: f64,
    /// Frames since `last_seen` on which the detector ran.
    misses: u32,
    depth: Option<f32>,
    /// Index of the detection of the present frame, and its box.
    matched: Option<(usize, BoundingBox)>,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    /// Detections of the frame that take part, in canonical order.
    candidates: Vec<usize>,
    /// The tracks and detections of one label that are still to be paired.
    open_tracks: Vec<usize>,
    open_detections: Vec<usize>,
    iou: Vec<f64>,
    assignment: Assignment,
}

impl BoxTracker {
    /// A tracker without tracks.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: TrackerConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self {
            config,
            tracks: Vec::new(),
            next_id: 0,
            last_timestamp: None,
            last_look: f64::NEG_INFINITY,
            look_intervals: [f64::INFINITY; 2],
            last_view: None,
            boxes: Vec::new(),
            scratch: Scratch::default(),
        })
    }

    /// Processes the detections of one frame, at `timestamp` seconds, and returns the boxes of all tracks
    /// that are in view or coasting, by ascending track id. `view` is the camera and pose of the frame;
    /// without it the camera's motion is unknown.
    ///
    /// Frames may be missing, and the frame rate may be anything; a frame with the time of the last one is a
    /// step of zero duration.
    ///
    /// # Errors
    ///
    /// [`Error::Timestamp`], [`Error::TimeReversed`]; the tracker stays as it was.
    pub fn update(
        &mut self,
        timestamp: f64,
        detections: &[Detection],
        view: Option<&View>,
    ) -> Result<&[TrackedBox], Error> {
        self.update_where(timestamp, detections, view, |_| true)
    }

    /// [`Self::update`] with only those detections that `wanted` chooses.
    ///
    /// # Errors
    ///
    /// As [`Self::update`].
    pub fn update_where(
        &mut self,
        timestamp: f64,
        detections: &[Detection],
        view: Option<&View>,
        wanted: impl Fn(&Detection) -> bool,
    ) -> Result<&[TrackedBox], Error> {
        let elapsed = self.check_time(timestamp)?;
        self.move_on(elapsed, view);
        // During a pause in the frames nobody did.
        self.forget_lost(timestamp);
        // A second look at the same time says nothing of the detector's pace.
        if timestamp > self.last_look {
            self.look_intervals = [timestamp - self.last_look, self.look_intervals[0]];
            self.last_look = timestamp;
        }
        self.choose_candidates(detections, wanted);
        self.associate(timestamp, detections);
        self.start_tracks(timestamp, detections);
        for track in self.tracks.iter_mut().filter(|track| track.matched.is_none()) {
            track.misses = track.misses.saturating_add(1);
        }
        Ok(self.finish(timestamp, view))
    }

    /// Processes a frame on which the detector did not run, which says nothing about who is in it. Returns
    /// the predicted boxes of all tracks that were in view or coasting when the detector last ran, as long as
    /// they are remembered ([`TrackerConfig::max_age`], or two looks at the detector's pace), but at most for
    /// 5 s after they were detected (or [`TrackerConfig::max_coast`] if that is longer).
    ///
    /// # Errors
    ///
    /// As [`Self::update`].
    pub fn predict(&mut self, timestamp: f64, view: Option<&View>) -> Result<&[TrackedBox], Error> {
        let elapsed = self.check_time(timestamp)?;
        self.move_on(elapsed, view);
        Ok(self.finish(timestamp, view))
    }

    /// Converts the stored pose after the world frame was moved; poses of later frames are in the new frame.
    pub fn move_world(&mut self, new_from_old: &Pose) {
        if let Some(view) = &mut self.last_view {
            view.world_from_camera = *new_from_old * view.world_from_camera;
        }
    }

    fn finish(&mut self, timestamp: f64, view: Option<&View>) -> &[TrackedBox] {
        self.forget_lost(timestamp);
        self.collect_boxes(timestamp);
        self.last_timestamp = Some(timestamp);
        self.last_view = view.copied();
        &self.boxes
    }

    /// The boxes that the last frame returned.
    pub fn boxes(&self) -> &[TrackedBox] {
        &self.boxes
    }

    /// Sets the depth of a track's foreground in the present frame, metres. Depths that are no readings, and
    /// unknown ids, are ignored.
    pub fn observe_depth(&mut self, track_id: TrackId, depth: f32) {
        if depth > 0.0
            && depth.is_finite()
            && let Some(track) = self.tracks.iter_mut().find(|track| track.id == track_id)
        {
            track.depth = Some(depth);
        }
    }

    /// Whether the detector has run since a track's last detection, and not found it. So have tracks that are
    /// forgotten.
    pub(crate) fn has_missed(&self, track_id: TrackId) -> bool {
        self.tracks.iter().find(|track| track.id == track_id).is_none_or(|track| track.misses > 0)
    }

    /// New tracks get no id that another tracker has already given.
    pub(crate) fn continue_ids_of(&mut self, other: &Self) {
        self.next_id = self.next_id.max(other.next_id);
    }

    /// Seconds since the last frame; an error when a frame at this time would be refused.
    pub(crate) fn check_time(&self, timestamp: f64) -> Result<f64, Error> {
        check_timestamp(timestamp)?;
        match self.last_timestamp {
            Some(previous) if timestamp < previous => Err(Error::TimeReversed { previous, timestamp }),
            Some(previous) => Ok(timestamp - previous),
            None => Ok(0.0),
        }
    }

    /// Predicts all tracks in the present image and at the present time.
    fn move_on(&mut self, elapsed: f64, view: Option<&View>) {
        let views = self.last_view.as_ref().zip(view);
        self.tracks.retain_mut(|track| {
            // Who is behind the camera now is not in the image.
            if views.is_some_and(|(before, now)| track.reproject(before, now).is_none()) {
                return false;
            }
            track.filter.predict(elapsed);
            track.matched = None;
            track.filter.bounding_box().is_some()
        });
    }

    /// Chooses the detections that take part and sorts them, so that the caller's order does not matter.
    fn choose_candidates(&mut self, detections: &[Detection], wanted: impl Fn(&Detection) -> bool) {
        let candidates = &mut self.scratch.candidates;
        candidates.clear();
        candidates.extend(detections.iter().enumerate().filter_map(|(index, detection)| {
            let usable = detection.score() >= LOW_SCORE && detection.bounding_box().area() > 0.0;
            (usable && wanted(detection)).then_some(index)
        }));
        candidates.sort_by(|&a, &b| canonical_order(&detections[a], &detections[b]));
    }

    /// Pairs tracks and detections, label by label: first with strong detections, then with weak ones, then
    /// with the remaining strong ones within walking distance.
    fn associate(&mut self, timestamp: f64, detections: &[Detection]) {
        let candidates = std::mem::take(&mut self.scratch.candidates);
        for of_label in candidates.chunk_by(|&a, &b| detections[a].label() == detections[b].label()) {
            let strong = of_label.partition_point(|&i| detections[i].score() >= self.config.high_score);
            let (strong, weak) = of_label.split_at(strong);
            self.pair(timestamp, detections, strong, |_, predicted, found| predicted.iou(found));
            self.pair(timestamp, detections, weak, |_, predicted, found| predicted.iou(found));
            let memory = self.memory();
            self.pair(timestamp, detections, strong, |track, predicted, found| {
                let elapsed = timestamp - track.last_seen;
                let is_new = track.misses == 0 && elapsed <= memory;
                if is_new { track.likeness_within_reach(predicted.center(), found, elapsed) } else { 0.0 }
            });
        }
        self.scratch.candidates = candidates;
    }

    /// Pairs the unmatched `candidates`, which have one label, with the unmatched tracks of that label so
    /// that the sum of `likeness` (of track, predicted box and detection) is greatest.
    fn pair(
        &mut self,
        timestamp: f64,
        detections: &[Detection],
        candidates: &[usize],
        likeness: impl Fn(&Track, &BoundingBox, &BoundingBox) -> f64,
    ) {
        let Some(label) = candidates.first().map(|&first| detections[first].label()) else { return };
        let Scratch { open_tracks, open_detections, iou, assignment, .. } = &mut self.scratch;
        open_tracks.clear();
        iou.clear();
        open_detections.clear();
        open_detections.extend(candidates.iter().copied().filter(|&index| !is_taken(&self.tracks, index)));
        for (index, track) in self.tracks.iter().enumerate() {
            if track.matched.is_none()
                && *track.label == *label
                && let Some(predicted) = track.predicted_box()
            {
                open_tracks.push(index);
                let found = open_detections.iter().map(|&index| detections[index].bounding_box());
                iou.extend(found.map(|found| likeness(track, &predicted, &found)));
            }
        }
        let matches = pair_by_iou(assignment, iou, open_detections.len(), self.config.min_iou.into());

        for (&index, matched) in open_tracks.iter().zip(matches) {
            if let Some(candidate) = *matched {
                let detection = open_detections[candidate];
                self.tracks[index].take(timestamp, detection, &detections[detection]);
            }
        }
    }

    /// Every unmatched detection of at least `min_score` starts a track.
    fn start_tracks(&mut self, timestamp: f64, detections: &[Detection]) {
        let open = &mut self.scratch.open_detections;
        open.clear();
        open.extend(self.scratch.candidates.iter().copied().filter(|&candidate| {
            !is_taken(&self.tracks, candidate) && detections[candidate].score() >= self.config.min_score
        }));
        for &candidate in &*open {
            let detection = &detections[candidate];
            let filter = BoxKalman::new(&detection.bounding_box());
            self.tracks.push(Track {
                id: TrackId::new(self.next_id),
                label: known_label(&self.tracks, detection.label()),
                seen_area: filter.area(),
                seen_size: size_of(detection),
                roll: 0.0,
                filter,
                score: detection.score(),
                first_seen: timestamp,
                last_seen: timestamp,
                misses: 0,
                depth: None,
                matched: Some((candidate, detection.bounding_box())),
            });
            self.next_id += 1;
        }
    }

    /// How long a track without a detection is remembered, seconds: as long as it takes a detector at its usual
    /// pace to miss it once and look again. A pause is not its pace. Until the second look, which may be
    /// seconds away, its pace is unknown.
    fn memory(&self) -> f64 {
        let [newest, before] = self.look_intervals;
        let two_looks = (2.0 * newest.min(before)).min(LONGEST_MEMORY);
        self.config.max_age.max(self.config.max_coast).max(two_looks) + TIME_SLACK
    }

    fn forget_lost(&mut self, timestamp: f64) {
        let memory = self.memory();
        self.tracks.retain(|track| track.matched.is_some() || timestamp - track.last_seen <= memory);
        if self.tracks.len() > MAX_TRACKS {
            // Those in this frame are kept, and those seen last; among those seen at the same time, the
            // older ones.
            self.tracks.sort_by(|a, b| {
                let is_here = b.matched.is_some().cmp(&a.matched.is_some());
                is_here.then(b.last_seen.total_cmp(&a.last_seen)).then(a.id.cmp(&b.id))
            });
            let seen_now = self.tracks.iter().filter(|track| track.matched.is_some()).count();
            self.tracks.truncate(MAX_TRACKS.max(seen_now));
            self.tracks.sort_by_key(|track| track.id);
        }
    }

    fn collect_boxes(&mut self, timestamp: f64) {
        let mut boxes = std::mem::take(&mut self.boxes);
        boxes.clear();
        boxes.extend(self.tracks.iter().filter_map(|track| self.box_of(track, timestamp)));
        self.boxes = boxes;
    }

    /// The box of a track that is in view or coasting.
    fn box_of(&self, track: &Track, timestamp: f64) -> Option<TrackedBox> {
        let missed_for = timestamp - track.last_seen;
        let is_recent = missed_for <= self.config.max_coast.max(LONGEST_PREDICTION) + TIME_SLACK;
        let age = track.last_seen - track.first_seen;
        let is_confirmed = age >= self.config.confirm_after - TIME_SLACK;
        let filtered_box =
            if track.matched.is_some() { track.filter.bounding_box() } else { track.predicted_box() };
        let (source, bounding_box) = match track.matched {
            Some((detection, bounding_box)) => (BoxSource::Detected { detection }, bounding_box),
            None if is_recent && (track.misses == 0 || (is_confirmed && self.coasts(track))) => {
                (BoxSource::Predicted { missed_for }, filtered_box?)
            }
            None => return None,
        };
        Some(TrackedBox {
            track_id: track.id,
            label: Arc::clone(&track.label),
            score: track.score,
            bounding_box,
            filtered_box: filtered_box.unwrap_or(bounding_box),
            source,
            state: if is_confirmed { TrackState::Confirmed } else { TrackState::Tentative },
            expected_depth: track.depth,
        })
    }

    /// Whether a track that the detector missed is still output.
    fn coasts(&self, track: &Track) -> bool {
        let missed_for = self.last_look - track.last_seen;
        self.config.max_coast > 0.0 && (track.misses <= 1 || missed_for <= self.config.max_coast + TIME_SLACK)
    }
}

/// Whether a track is matched with a detection of the present frame.
fn is_taken(tracks: &[Track], detection: usize) -> bool {
    tracks.iter().any(|track| track.matched.is_some_and(|(index, _)| index == detection))
}

impl Track {
    /// Moves the track as the camera's own motion does; `None` where it comes to lie behind the camera.
    fn reproject(&mut self, before: &View, now: &View) -> Option<()> {
        let Reprojection { depth, scale, roll } =
            ego_motion::compensate(&mut self.filter, self.depth, before, now)?;
        self.depth = depth;
        self.seen_area *= scale * scale;
        self.seen_size = self.seen_size.map(|side| side * scale);
        self.roll += roll;
        self.filter.turn(roll);
        Some(())
    }

    /// The box in the present frame, as long as none was found.
    fn predicted_box(&self) -> Option<BoundingBox> {
        self.filter.box_since(self.seen_area, self.turned_size())
    }

    /// The sides of the box around the ellipse in the detected box, which has turned with the image. A body
    /// has no corners; those of a turned box would reach far beyond it.
    fn turned_size(&self) -> [f64; 2] {
        let ((sin, cos), [width, height]) = (self.roll.sin_cos(), self.seen_size);
        [(width * cos).hypot(height * sin), (width * sin).hypot(height * cos)]
    }

    /// Likeness of a detection and the track whose centre is predicted `elapsed` seconds after it was seen: the
    /// intersection over union of its box as it was seen and the detection's when centred on each other,
    /// decreasing with their distance; 0 when they are farther apart than the person in the box can have walked.
    ///
    /// Nobody walks farther than their own height, 1.7 m, in a second; that is the longest side of the box,
    /// whichever way up the camera is. A detector that runs once a second gives boxes that do not even overlap
    /// (`misses_are_bridged_at_every_frame_rate`).
    fn likeness_within_reach(&self, [x, y]: [f32; 2], found: &BoundingBox, elapsed: f64) -> f64 {
        let ([width, height], found_size) =
            (self.turned_size(), [found.width(), found.height()].map(f64::from));
        let shared = width.min(found_size[0]) * height.min(found_size[1]);
        let likeness = shared / (width * height + found_size[0] * found_size[1] - shared);
        let [found_x, found_y] = found.center();
        let apart = f64::from((x - found_x).hypot(y - found_y));
        let reach = elapsed * [width, height].into_iter().chain(found_size).fold(0.0, f64::max);
        if apart < reach { likeness * (1.0 - apart / reach) } else { 0.0 }
    }

    fn take(&mut self, timestamp: f64, index: usize, detection: &Detection) {
        self.filter.update(&detection.bounding_box());
        (self.seen_area, self.seen_size, self.roll) = (self.filter.area(), size_of(detection), 0.0);
        self.score = detection.score();
        self.last_seen = timestamp;
        self.misses = 0;
        self.matched = Some((index, detection.bounding_box()));
    }
}

/// Width and height of a detection's box, pixels.
fn size_of(detection: &Detection) -> [f64; 2] {
    let found = detection.bounding_box();
    [found.width(), found.height()].map(f64::from)
}

/// By label, then by descending score, then by place.
fn canonical_order(a: &Detection, b: &Detection) -> Ordering {
    let place = |detection: &Detection| <[f32; 4]>::from(detection.bounding_box());
    let by_place = || {
        let pairs = place(a).into_iter().zip(place(b));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    a.label().cmp(b.label()).then(b.score().total_cmp(&a.score())).then_with(by_place)
}

/// The label, shared with a track that already has it.
fn known_label(tracks: &[Track], label: &str) -> Arc<str> {
    tracks
        .iter()
        .find(|track| *track.label == *label)
        .map_or_else(|| label.into(), |track| track.label.clone())
}

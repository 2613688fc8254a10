use std::cmp::Ordering;
use std::sync::Arc;

use dymlm_core::{BoundingBox, Detection, Pose, TrackId};
use dymlm_geometry::Assignment;

use super::assignment::pair_by_iou;
use super::ego_motion;
use super::{BoxKalman, BoxSource, TrackState, TrackedBox, TrackerConfig, View};
use crate::{Error, check_timestamp};

/// Detections of a lower score are ignored (`ByteTrack`).
pub(crate) const LOW_SCORE: f32 = 0.1;
/// Most tracks that are remembered: thrice as many as a detector sees things, at once or in the time after
/// which a track is forgotten. Each costs as much as a detection.
const MAX_TRACKS: usize = 1000;
/// Rounding of timestamps, seconds: three frames at 6 Hz are half a second.
const TIME_SLACK: f64 = 1e-3;

/// Tracks the boxes of a 2D detector from frame to frame, label by label.
///
/// SORT (Bewley, Ge, Ott, Ramos, Upcroft: "Simple Online and Realtime Tracking", ICIP 2016): each track's box
/// is predicted by a [`BoxKalman`] and paired with the frame's detections so that the sum of the
/// intersections over union is greatest. Added to it:
/// - a second association of the tracks left over with the weak detections (Zhang et al.: "`ByteTrack`:
///   Multi-Object Tracking by Associating Every Detection Box", ECCV 2022), for a weak box often is the
///   missed person;
/// - true time steps instead of frame counts;
/// - ego-motion compensation, when the camera's [`View`] is given: a track is first re-projected from the
///   image before as a thing at rest, at the depth given to [`Self::observe_depth`] (without one, only the
///   camera's rotation is undone);
/// - a third one of the tracks and strong detections left over, by how far somebody may have gone since the
///   detector looked: at a frame a second boxes do not overlap;
/// - unmatched tracks are output, for a while, as [`BoxSource::Predicted`].
///
/// A frame of n tracks and m detections costs O(n m), and O((n + m)^3) among boxes that compete. At most a
/// thousand tracks are remembered, or as many as the last frame had detections: of more, those that were seen
/// last. The order of the detections does not matter. Empty boxes are ignored.
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
/// // The detector misses: the track goes on by itself.
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
    /// Time of the last frame that the detector looked at.
    last_look: f64,
    last_view: Option<View>,
    boxes: Vec<TrackedBox>,
    scratch: Scratch,
}

#[derive(Debug, Clone)]
struct Track {
    id: TrackId,
    label: Arc<str>,
    filter: BoxKalman,
    score: f32,
    first_seen: f64,
    last_seen: f64,
    /// Frames since then that the detector looked at.
    misses: u32,
    depth: Option<f32>,
    /// Box and detection in the present frame.
    matched: Option<(usize, BoundingBox)>,
}

#[derive(Debug, Clone, Default)]
struct Scratch {
    /// Detections of the frame that take part, in an order of their own.
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
            last_view: None,
            boxes: Vec::new(),
            scratch: Scratch::default(),
        })
    }

    /// Takes the detections of one frame, at `timestamp` seconds, and answers the boxes of all tracks that
    /// are in view or coasting, by ascending track id. `view` says from where the frame was seen; without it
    /// nothing is known of the camera's motion.
    ///
    /// Frames may be missing and of any rate; a frame of the same time as the last one is a step of no
    /// duration.
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
        self.last_look = timestamp;
        self.choose_candidates(detections, wanted);
        self.associate(timestamp, detections);
        self.start_tracks(timestamp, detections);
        for track in self.tracks.iter_mut().filter(|track| track.matched.is_none()) {
            track.misses = track.misses.saturating_add(1);
        }
        Ok(self.finish(timestamp, view))
    }

    /// A frame on which the detector did not run, which says nothing about who is in it: the boxes of all
    /// tracks that were in view or coasting when it last ran, as their motion puts them now.
    ///
    /// # Errors
    ///
    /// As [`Self::update`].
    pub fn predict(&mut self, timestamp: f64, view: Option<&View>) -> Result<&[TrackedBox], Error> {
        let elapsed = self.check_time(timestamp)?;
        self.move_on(elapsed, view);
        Ok(self.finish(timestamp, view))
    }

    /// Follows a world that was moved.
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

    /// The boxes that the last frame gave.
    pub fn boxes(&self) -> &[TrackedBox] {
        &self.boxes
    }

    /// Tells the depth of a track's foreground in the present frame, metres. Depths that are no reading and
    /// ids that are no longer known are passed over.
    pub fn observe_depth(&mut self, track_id: TrackId, depth: f32) {
        if depth > 0.0
            && depth.is_finite()
            && let Some(track) = self.tracks.iter_mut().find(|track| track.id == track_id)
        {
            track.depth = Some(depth);
        }
    }

    /// Gives no id to new tracks that another tracker has given.
    pub(crate) fn continue_ids_of(&mut self, other: &Self) {
        self.next_id = self.next_id.max(other.next_id);
    }

    /// Seconds since the last frame, if a frame of this time would be taken.
    pub(crate) fn check_time(&self, timestamp: f64) -> Result<f64, Error> {
        check_timestamp(timestamp)?;
        match self.last_timestamp {
            Some(previous) if timestamp < previous => Err(Error::TimeReversed { previous, timestamp }),
            Some(previous) => Ok(timestamp - previous),
            None => Ok(0.0),
        }
    }

    /// Carries all tracks over into the present image and time.
    fn move_on(&mut self, elapsed: f64, view: Option<&View>) {
        for track in &mut self.tracks {
            if let (Some(before), Some(now)) = (&self.last_view, view) {
                track.depth = ego_motion::compensate(&mut track.filter, track.depth, before, now);
            }
            track.filter.predict(elapsed);
            track.matched = None;
        }
        self.tracks.retain(|track| track.filter.bounding_box().is_some());
    }

    /// Chooses the detections that take part and puts them into an order that does not depend on the
    /// caller's.
    fn choose_candidates(&mut self, detections: &[Detection], wanted: impl Fn(&Detection) -> bool) {
        let candidates = &mut self.scratch.candidates;
        candidates.clear();
        candidates.extend(detections.iter().enumerate().filter_map(|(index, detection)| {
            let usable = detection.score() >= LOW_SCORE && detection.bounding_box().area() > 0.0;
            (usable && wanted(detection)).then_some(index)
        }));
        candidates.sort_by(|&a, &b| canonical_order(&detections[a], &detections[b]));
    }

    /// Pairs tracks and detections, label by label: first with the strong detections, then with the weak
    /// ones.
    fn associate(&mut self, timestamp: f64, detections: &[Detection]) {
        let candidates = std::mem::take(&mut self.scratch.candidates);
        for of_label in candidates.chunk_by(|&a, &b| detections[a].label() == detections[b].label()) {
            let strong = of_label.partition_point(|&i| detections[i].score() >= self.config.high_score);
            let (strong, weak) = of_label.split_at(strong);
            self.pair(timestamp, detections, strong, |_, predicted, found| predicted.iou(found));
            self.pair(timestamp, detections, weak, |_, predicted, found| predicted.iou(found));
            let memory = self.config.max_age + TIME_SLACK;
            self.pair(timestamp, detections, strong, |track, predicted, found| {
                let elapsed = timestamp - track.last_seen;
                let is_new = track.misses == 0 && elapsed <= memory;
                if is_new { likeness_within_reach(predicted, found, elapsed) } else { 0.0 }
            });
        }
        self.scratch.candidates = candidates;
    }

    /// Pairs those of `candidates`, which are of one label, that no track took with the unmatched tracks of
    /// that label: the sum of what `likeness` says of track, predicted box and detection is greatest.
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
                && let Some(predicted) = track.filter.bounding_box()
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

    /// Every detection of at least `min_score` that no track took starts one.
    fn start_tracks(&mut self, timestamp: f64, detections: &[Detection]) {
        let open = &mut self.scratch.open_detections;
        open.clear();
        open.extend(self.scratch.candidates.iter().copied().filter(|&candidate| {
            !is_taken(&self.tracks, candidate) && detections[candidate].score() >= self.config.min_score
        }));
        for &candidate in &*open {
            let detection = &detections[candidate];
            self.tracks.push(Track {
                id: TrackId::new(self.next_id),
                label: known_label(&self.tracks, detection.label()),
                filter: BoxKalman::new(&detection.bounding_box()),
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

    fn forget_lost(&mut self, timestamp: f64) {
        let max_age = self.config.max_age.max(self.config.max_coast);
        self.tracks
            .retain(|track| track.matched.is_some() || timestamp - track.last_seen <= max_age + TIME_SLACK);
        if self.tracks.len() > MAX_TRACKS {
            // Those that were seen last; of as many, the older ones.
            self.tracks.sort_by(|a, b| b.last_seen.total_cmp(&a.last_seen).then(a.id.cmp(&b.id)));
            let seen_now = self.tracks.iter().take_while(|track| track.matched.is_some()).count();
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

    /// The box of a track that is in view or coasts.
    fn box_of(&self, track: &Track, timestamp: f64) -> Option<TrackedBox> {
        let age = track.last_seen - track.first_seen;
        let is_confirmed = age >= self.config.confirm_after - TIME_SLACK;
        let filtered_box = track.filter.bounding_box();
        let (source, bounding_box) = match track.matched {
            Some((detection, bounding_box)) => (BoxSource::Detected { detection }, bounding_box),
            None if track.misses == 0 || (is_confirmed && self.coasts(track)) => {
                (BoxSource::Predicted { missed_for: timestamp - track.last_seen }, filtered_box?)
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

    /// Whether a track that the detector missed is still to be output.
    fn coasts(&self, track: &Track) -> bool {
        let missed_for = self.last_look - track.last_seen;
        self.config.max_coast > 0.0 && (track.misses <= 1 || missed_for <= self.config.max_coast + TIME_SLACK)
    }
}

/// Whether a track has taken a detection in the present frame.
fn is_taken(tracks: &[Track], detection: usize) -> bool {
    tracks.iter().any(|track| track.matched.is_some_and(|(index, _)| index == detection))
}

/// How much a detection is like a box that may have gone on for `elapsed` seconds: the intersection over
/// union of both when centred, less the farther they are apart; 0 when that is farther than who is seen in
/// the box can have gone.
///
/// Nobody walks farther than their own height in a second, 1.7 m. A detector that looks once a second sees
/// boxes that do not even overlap (`misses_are_bridged_at_every_frame_rate`).
fn likeness_within_reach(predicted: &BoundingBox, found: &BoundingBox, elapsed: f64) -> f64 {
    let [width, height] = [predicted.width().min(found.width()), predicted.height().min(found.height())];
    let shared = f64::from(width * height);
    let likeness = shared / (f64::from(predicted.area() + found.area()) - shared);
    let ([x, y], [other_x, other_y]) = (predicted.center(), found.center());
    let apart = f64::from((x - other_x).hypot(y - other_y));
    let reach = elapsed * f64::from(predicted.height().max(found.height()));
    if apart < reach { likeness * (1.0 - apart / reach) } else { 0.0 }
}

impl Track {
    fn take(&mut self, timestamp: f64, index: usize, detection: &Detection) {
        self.filter.update(&detection.bounding_box());
        self.score = detection.score();
        self.last_seen = timestamp;
        self.misses = 0;
        self.matched = Some((index, detection.bounding_box()));
    }
}

/// By label, then the surest first, then by place.
fn canonical_order(a: &Detection, b: &Detection) -> Ordering {
    let place = |detection: &Detection| <[f32; 4]>::from(detection.bounding_box());
    let by_place = || {
        let pairs = place(a).into_iter().zip(place(b));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    };
    a.label().cmp(b.label()).then(b.score().total_cmp(&a.score())).then_with(by_place)
}

/// The label, shared with a track that has it already.
fn known_label(tracks: &[Track], label: &str) -> Arc<str> {
    tracks
        .iter()
        .find(|track| *track.label == *label)
        .map_or_else(|| label.into(), |track| track.label.clone())
}

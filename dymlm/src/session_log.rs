use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::{ColorImage, FrameId, ObjectId, Pages, PlaneId, Point, Pose, Succession};
use dymlm_geometry::OrientedBox;
use dymlm_history::{History, Observation};
use dymlm_objects::ObjectReport;
use dymlm_planes::PlaneReport;

use crate::logged_sessions::Session;
use crate::witnesses::Witnesses;
use crate::{Error, MapUpdate};

/// Everything that has happened in all sessions, in its order: what is needed to build the maps again at
/// other poses.
#[derive(Debug, Clone)]
pub(crate) struct SessionLog {
    /// What the key frames have shown.
    pub(crate) history: History,
    /// The sessions in which frames have come.
    pub(crate) sessions: Vec<Session>,
    /// Time and pose of each frame that was inserted, by its id.
    pub(crate) frames: Pages<InsertedFrame>,
    pub(crate) events: Pages<Event>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct InsertedFrame {
    /// Time on the clock of its session, seconds.
    pub(crate) timestamp: f64,
    /// Seconds from that clock to the maps'.
    pub(crate) clock_offset: f64,
    pub(crate) world_from_camera: Pose,
}

/// Something that changed the maps. Places are stored in the camera coordinates of the newest frame that was
/// mapped, and an event is applied from these coordinates even the first time: so a replay with the same pose
/// of that frame gives the same bits, whatever has been corrected meanwhile.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) enum Event {
    /// A further session began, with frame `first` if any comes; none if none had come when the maps were
    /// merged.
    SessionBegan {
        first: Option<FrameId>,
    },
    KeyFrame(KeyFrameEntry),
    Scan(ScanEntry),
    /// Ghosts were removed on request.
    Settled,
    Forgot {
        newest: FrameId,
        center: [f64; 3],
        radius: f64,
    },
    /// Somebody began to carry an object, or stopped.
    Held {
        object: Witnesses,
        is_held: bool,
    },
    /// An object was put down elsewhere.
    Moved {
        newest: FrameId,
        object: Witnesses,
        /// In a box, since key frames are many and moved objects are few.
        motion: Box<BodyMotion>,
    },
}

/// A key frame that was mapped.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct KeyFrameEntry {
    pub(crate) frame: FrameId,
    /// Number under which the history keeps its observation.
    pub(crate) observation: usize,
    pub(crate) seen: SeenThings,
}

/// A scan that was mapped.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ScanEntry {
    pub(crate) frame: FrameId,
    /// Number under which the history keeps its points.
    pub(crate) points: usize,
}

/// The planes and objects of the maps that a key frame has observed.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SeenThings {
    /// The plane of the map, for each detected plane.
    pub(crate) planes: Vec<PlaneId>,
    /// Detection and object, by detection; not every detection is of an object.
    pub(crate) objects: Vec<(usize, ObjectId)>,
}

/// How an object moved when it was put down elsewhere.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct BodyMotion {
    pub(crate) new_from_old: Pose,
    /// Its box where it stood, as its tracker knows it.
    pub(crate) tracked: Option<OrientedBox>,
}

impl InsertedFrame {
    /// Its time on the maps' clock.
    pub(crate) fn map_time(&self) -> f64 {
        self.timestamp + self.clock_offset
    }
}

impl SessionLog {
    /// Approximate bytes that the log holds in memory, without the observations that are kept in a file.
    pub(crate) fn memory_bytes(&self) -> usize {
        let events = event_bytes_beside(&self.events, &Pages::default());
        self.history.memory_bytes() + self.frames.memory_bytes() + events
    }
}

/// Approximate bytes of events that another list of events does not share.
pub(crate) fn event_bytes_beside(events: &Pages<Event>, other: &Pages<Event>) -> usize {
    let owned = events.unshared(other).map(|place| events[place].memory_bytes());
    events.memory_bytes_beside(other) + owned.sum::<usize>()
}

impl Event {
    /// Approximate bytes that the event owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::KeyFrame(entry) => entry.seen.memory_bytes(),
            Self::Held { object, .. } | Self::Moved { object, .. } => object.memory_bytes(),
            _ => 0,
        }
    }

    pub(crate) fn key_frame(&self) -> Option<&KeyFrameEntry> {
        match self {
            Self::KeyFrame(entry) => Some(entry),
            _ => None,
        }
    }

    /// The frame or scan that was mapped, if it is one.
    pub(crate) fn mapped(&self) -> Option<FrameId> {
        match self {
            Self::KeyFrame(entry) => Some(entry.frame),
            Self::Scan(entry) => Some(entry.frame),
            _ => None,
        }
    }

    /// The frame that a replay of the event needs, if it needs one.
    pub(crate) fn frame(&self) -> Option<FrameId> {
        match self {
            Self::Forgot { newest, .. } | Self::Moved { newest, .. } => Some(*newest),
            _ => self.mapped(),
        }
    }

    /// Number under which the history keeps what it has shown, if it has shown anything.
    pub(crate) fn observation(&self) -> Option<usize> {
        match self {
            Self::KeyFrame(entry) => Some(entry.observation),
            Self::Scan(entry) => Some(entry.points),
            _ => None,
        }
    }

    pub(crate) fn observation_mut(&mut self) -> Option<&mut usize> {
        match self {
            Self::KeyFrame(entry) => Some(&mut entry.observation),
            Self::Scan(entry) => Some(&mut entry.points),
            _ => None,
        }
    }

    /// Renames the frames; the new ids ascend as the old ones do.
    pub(crate) fn rename_frames(
        &mut self,
        name: &impl Fn(FrameId) -> Result<FrameId, Error>,
    ) -> Result<(), Error> {
        match self {
            Self::KeyFrame(KeyFrameEntry { frame, .. })
            | Self::Scan(ScanEntry { frame, .. })
            | Self::Forgot { newest: frame, .. } => *frame = name(*frame)?,
            // A session without frames is no session of its own in the merged log.
            Self::SessionBegan { first } => *first = None,
            Self::Settled => {}
            Self::Held { object, .. } => object.rename_frames(name)?,
            Self::Moved { newest, object, .. } => {
                *newest = name(*newest)?;
                object.rename_frames(name)?;
            }
        }
        Ok(())
    }

    /// Whether the same has happened, whatever was observed and in whichever map.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::KeyFrame(one), Self::KeyFrame(other)) => one.frame == other.frame,
            (Self::Scan(one), Self::Scan(other)) => one.frame == other.frame,
            (one, other) => one == other,
        }
    }

    pub(crate) fn key_frame_mut(&mut self) -> Option<&mut KeyFrameEntry> {
        match self {
            Self::KeyFrame(entry) => Some(entry),
            _ => None,
        }
    }
}

impl BodyMotion {
    /// The same motion in other coordinates.
    pub(crate) fn seen_from(&self, new_from_old: &Pose) -> Self {
        Self {
            new_from_old: *new_from_old * self.new_from_old * new_from_old.inverse(),
            tracked: self.tracked.as_ref().map(|body| body.transformed(new_from_old)),
        }
    }
}

impl SeenThings {
    /// Bytes that it owns.
    fn memory_bytes(&self) -> usize {
        self.planes.capacity() * size_of::<PlaneId>()
            + self.objects.capacity() * size_of::<(usize, ObjectId)>()
    }

    pub(crate) fn of(planes: &PlaneReport, objects: &ObjectReport) -> Self {
        Self { planes: planes.associations.clone(), objects: objects.observed.clone() }
    }

    /// For each plane of an observation, its ids in two maps.
    pub(crate) fn shared_planes(old: &Self, new: &Self) -> impl Iterator<Item = (PlaneId, PlaneId)> {
        old.planes.iter().copied().zip(new.planes.iter().copied())
    }

    /// For each detection that is of an object in two maps, the object's ids in both.
    pub(crate) fn shared_objects(old: &Self, new: &Self) -> impl Iterator<Item = (ObjectId, ObjectId)> {
        old.objects.iter().filter_map(|&(detection, id)| {
            let place = new.objects.binary_search_by_key(&detection, |&(detection, _)| detection).ok()?;
            Some((id, new.objects[place].1))
        })
    }

    /// The same things by the names that they have from now on.
    pub(crate) fn renamed(
        &self,
        planes: &mut Succession<PlaneId>,
        objects: &mut Succession<ObjectId>,
    ) -> Self {
        Self {
            planes: self.planes.iter().map(|id| planes.of(*id)).collect(),
            objects: self.objects.iter().map(|&(detection, id)| (detection, objects.of(id))).collect(),
        }
    }

    /// Keeps the old object ids of detections that are of no object of the map now: a later correction may
    /// bring the object back.
    pub(crate) fn remember(&mut self, before: &Self, is_in_map: impl Fn(ObjectId) -> bool) {
        let known: BTreeSet<usize> =
            self.objects.iter().filter(|(_, id)| is_in_map(*id)).map(|(detection, _)| *detection).collect();
        let forgotten: BTreeMap<usize, ObjectId> =
            before.objects.iter().filter(|(detection, _)| !known.contains(detection)).copied().collect();
        self.objects.retain(|(detection, _)| !forgotten.contains_key(detection));
        self.objects.extend(forgotten);
        self.objects.sort_unstable();
    }
}

impl SessionLog {
    pub(crate) fn new(history: History) -> Self {
        Self { history, sessions: Vec::new(), frames: Pages::default(), events: Pages::default() }
    }

    /// Logs a key frame that has been mapped.
    pub(crate) fn add_key_frame(
        &mut self,
        frame: FrameId,
        observation: Arc<Observation>,
        update: &MapUpdate,
    ) {
        let (depth, color) = (observation.frame.depth(), observation.frame.color());
        // A camera that warms up gives frames without a reading, which are alike in all sessions.
        let has_readings = depth.data().iter().any(|&depth| depth > 0.0);
        if let Some(session) = self.sessions.last_mut().filter(|_| has_readings) {
            let colors = color.into_iter().flat_map(ColorImage::data).flatten();
            let depths = depth.data().iter().map(|depth| depth.to_bits());
            session.note_content(depths.chain(colors.map(|&value| value.into())));
        }
        let observation = self.history.push(observation);
        let seen = SeenThings::of(&update.planes, &update.objects);
        self.events.push(Event::KeyFrame(KeyFrameEntry { frame, observation, seen }));
    }

    /// Logs a scan that has been mapped.
    pub(crate) fn add_scan(&mut self, frame: FrameId, points: &[Point]) {
        if let Some(session) = self.sessions.last_mut().filter(|_| !points.is_empty()) {
            session.note_content(points.iter().flatten().map(|c| c.to_bits()));
        }
        let points = self.history.push_scan(points.into());
        self.events.push(Event::Scan(ScanEntry { frame, points }));
    }

    /// The newest frame or scan that has been mapped, and its pose.
    pub(crate) fn newest(&self) -> Option<(FrameId, Pose)> {
        let newest = self.events.iter().rev().find_map(Event::mapped)?;
        Some((newest, self.frame(newest)?.world_from_camera))
    }

    /// The pose of each frame and scan, by its id.
    pub(crate) fn poses(&self) -> impl Iterator<Item = Pose> {
        self.frames.iter().map(|frame| frame.world_from_camera)
    }

    /// The entry of a key frame, and the place of its event.
    pub(crate) fn key_frame(&self, frame: FrameId) -> Option<(usize, KeyFrameEntry)> {
        let mut events = self.events.iter().map(Event::key_frame).enumerate();
        events.find_map(|(place, entry)| Some(place).zip(entry.filter(|it| it.frame == frame).cloned()))
    }

    /// The key frames in their order.
    pub(crate) fn key_frames(&self) -> impl DoubleEndedIterator<Item = &KeyFrameEntry> {
        self.events.iter().filter_map(Event::key_frame)
    }

    /// The observation of a key frame, at its time on the maps' clock: that may have changed since it was
    /// recorded, if other sessions were put before its own. Costs its unpacking.
    pub(crate) fn observation(&self, entry: &KeyFrameEntry) -> Result<Arc<Observation>, Error> {
        let mut observation = self.history.get(entry.observation)?;
        let frame = self.frame(entry.frame).ok_or(Error::UnknownFrame { frame: entry.frame })?;
        if observation.frame.timestamp() != frame.map_time() {
            Arc::make_mut(&mut observation).frame.set_timestamp(frame.map_time())?;
        }
        Ok(observation)
    }

    /// Time and pose of a frame, as it is mapped now.
    pub(crate) fn frame(&self, id: FrameId) -> Option<&InsertedFrame> {
        self.frames.get(id.get() as usize)
    }
}

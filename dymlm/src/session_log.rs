use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::{FrameId, ObjectId, PlaneId, Point, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_history::{History, Observation};

use crate::MapUpdate;

/// What has happened in a session, in its order: all that is needed to build the maps again at other poses.
#[derive(Debug)]
pub(crate) struct SessionLog {
    /// What the key frames have shown.
    pub(crate) history: History,
    /// Time and pose of each frame that was inserted, by its id.
    pub(crate) frames: Vec<InsertedFrame>,
    pub(crate) events: Vec<Event>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct InsertedFrame {
    pub(crate) timestamp: f64,
    pub(crate) world_from_camera: Pose,
}

/// Something that changed the maps. Places of the world are those of the frame that was the newest.
#[derive(Debug, Clone)]
pub(crate) enum Event {
    KeyFrame(KeyFrameEntry),
    Scan(ScanEntry),
    /// Ghosts were removed because somebody asked for it.
    Settled,
    Forgot {
        newest: FrameId,
        center: [f64; 3],
        radius: f64,
    },
    /// Somebody carries an object, or does so no more.
    Held {
        object: ObjectId,
        is_held: bool,
    },
    Moved {
        newest: FrameId,
        body: MovedBody,
    },
}

/// A key frame that was mapped.
#[derive(Debug, Clone)]
pub(crate) struct KeyFrameEntry {
    pub(crate) frame: FrameId,
    /// Its number in the history.
    pub(crate) observation: usize,
    pub(crate) seen: SeenThings,
}

/// A scan that was mapped.
#[derive(Debug, Clone)]
pub(crate) struct ScanEntry {
    pub(crate) frame: FrameId,
    /// As they were given, in the sensor's frame.
    pub(crate) points: Arc<[Point]>,
}

/// Which things of the maps a key frame has observed.
#[derive(Debug, Clone, Default)]
pub(crate) struct SeenThings {
    /// For each detected plane.
    pub(crate) planes: Vec<PlaneId>,
    /// By detection; not all are of an object.
    pub(crate) objects: Vec<(usize, ObjectId)>,
}

/// An object that was put down elsewhere.
#[derive(Debug, Clone)]
pub(crate) struct MovedBody {
    pub(crate) object: ObjectId,
    pub(crate) new_from_old: Pose,
    /// Where it stood, as its tracker knows.
    pub(crate) tracked: Option<OrientedBox>,
}

impl Event {
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

    pub(crate) fn key_frame_mut(&mut self) -> Option<&mut KeyFrameEntry> {
        match self {
            Self::KeyFrame(entry) => Some(entry),
            _ => None,
        }
    }

    /// Calls planes and objects by other ids.
    pub(crate) fn rename(
        &mut self,
        planes: &BTreeMap<PlaneId, PlaneId>,
        objects: &BTreeMap<ObjectId, ObjectId>,
    ) {
        let rename_object = |id: &mut ObjectId| *id = objects.get(id).copied().unwrap_or(*id);
        match self {
            Self::KeyFrame(KeyFrameEntry { seen, .. }) => {
                seen.planes.iter_mut().for_each(|id| *id = planes.get(id).copied().unwrap_or(*id));
                seen.objects.iter_mut().for_each(|(_, id)| rename_object(id));
            }
            Self::Held { object, .. } => rename_object(object),
            Self::Moved { body, .. } => rename_object(&mut body.object),
            Self::Scan(_) | Self::Settled | Self::Forgot { .. } => {}
        }
    }
}

impl MovedBody {
    /// The same in a world that was moved.
    pub(crate) fn in_moved_world(&self, new_from_old: &Pose) -> Self {
        Self {
            object: self.object,
            new_from_old: *new_from_old * self.new_from_old * new_from_old.inverse(),
            tracked: self.tracked.as_ref().map(|body| body.transformed(new_from_old)),
        }
    }
}

impl SeenThings {
    pub(crate) fn of(update: &MapUpdate) -> Self {
        Self { planes: update.planes.associations.clone(), objects: update.objects.observed.clone() }
    }

    /// Remembers what detections were of that are of no object of the map now: a later correction may find it
    /// again.
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
        Self { history, frames: Vec::new(), events: Vec::new() }
    }

    /// Notes a key frame that has been mapped.
    pub(crate) fn add_key_frame(
        &mut self,
        frame: FrameId,
        observation: Arc<Observation>,
        update: &MapUpdate,
    ) {
        let observation = self.history.push(observation);
        self.events.push(Event::KeyFrame(KeyFrameEntry { frame, observation, seen: SeenThings::of(update) }));
    }

    /// The newest frame or scan that has been mapped; the first when there is none.
    pub(crate) fn newest(&self) -> FrameId {
        self.events.iter().rev().find_map(Event::mapped).unwrap_or(FrameId::new(0))
    }

    /// Bytes of the observations and scans in memory.
    pub(crate) fn memory_bytes(&self) -> usize {
        let bytes = |event: &Event| match event {
            Event::Scan(scan) => scan.points.len() * size_of::<Point>(),
            _ => 0,
        };
        self.history.memory_bytes() + self.events.iter().map(bytes).sum::<usize>()
    }

    /// The key frames in their order.
    pub(crate) fn key_frames(&self) -> impl DoubleEndedIterator<Item = &KeyFrameEntry> {
        self.events.iter().filter_map(Event::key_frame)
    }

    /// Where a frame was taken from, as it is mapped now.
    pub(crate) fn frame(&self, id: FrameId) -> Option<&InsertedFrame> {
        self.frames.get(id.get() as usize)
    }
}

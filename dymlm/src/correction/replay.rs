use std::sync::Arc;

use dymlm_core::{FrameId, ObjectId, Pages, PlaneId, Pose, Succession};

use super::identities::Identities;
use super::report::{CorrectionProgress, ThingChanges};
use super::thing_changes::{objects_changed, planes_changed};
use crate::key_frame_view::{KeyFrameView, MappingContext};
use crate::scans::{Scan, ScanMapper};
use crate::session_log::{Event, KeyFrameEntry, SeenThings, SessionLog};
use crate::snapshots::Snapshots;
use crate::stages::StageClock;
use crate::{Error, MapConfig, MultiLevelMap};

/// Key frames that are unpacked at a time, at most: more wait less for each other, and take more memory.
const MOST_AT_A_TIME: usize = 16;

/// Builds the maps again from what key frames have shown, at other poses, from a state on in which nothing
/// has changed.
pub(super) struct Replay<'a> {
    log: &'a SessionLog,
    /// The pose of each frame, by its id.
    poses: &'a [Pose],
    before: &'a MultiLevelMap,
    pub(super) map: MultiLevelMap,
    /// What has happened, with what the key frames see in the new maps.
    events: Pages<Event>,
    snapshots: &'a mut Snapshots,
    scan_mapper: ScanMapper,
}

/// Maps that were built again, and what has become of what was in them.
pub(crate) struct Rebuilt {
    /// Without their past.
    pub(crate) map: MultiLevelMap,
    pub(crate) events: Pages<Event>,
    pub(crate) planes: ThingChanges<PlaneId>,
    pub(crate) objects: ThingChanges<ObjectId>,
}

impl<'a> Replay<'a> {
    /// Begins at the newest snapshot before the first event that has changed, else with empty maps. The
    /// snapshots behind it are dropped, and others taken.
    pub(super) fn new(
        log: &'a SessionLog,
        poses: &'a [Pose],
        before: &'a MultiLevelMap,
        snapshots: &'a mut Snapshots,
        first_changed: usize,
        config: &Arc<MapConfig>,
    ) -> Result<Self, Error> {
        let again = log.events.iter_from(first_changed).filter_map(Event::key_frame).count();
        snapshots.note_correction(again);
        snapshots.forget_behind(first_changed);
        let (mut map, events) = match snapshots.newest() {
            Some(snapshot) => (snapshot.map.clone(), snapshot.events.clone()),
            None => (MultiLevelMap::new(config)?, Pages::default()),
        };
        map.cloud.part_from_clones();
        let scan_mapper = ScanMapper::default();
        Ok(Self { log, poses, before, map, events, snapshots, scan_mapper })
    }

    /// Lets everything from there on happen again. `watch` is told before each few key frames how many will
    /// have been mapped then, and says whether to go on.
    pub(super) fn run(
        mut self,
        context: &MappingContext<'_>,
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<Rebuilt, Error> {
        let rest = self.log.events.iter_from(self.events.len());
        let mut progress = CorrectionProgress { done: 0, total: rest.filter_map(Event::key_frame).count() };
        while let Some(event) = self.log.events.get(self.events.len()) {
            let batch = self.next_batch();
            if batch.is_empty() {
                self.happen_again(event, context)?;
                continue;
            }
            progress.done += batch.len();
            if !watch(progress) {
                return Err(Error::Cancelled);
            }
            self.map_batch(&batch, context)?;
        }
        Ok(self.finish())
    }

    /// The key frames that come next, up to one after which ghosts are removed: until then no map asks
    /// another thread's.
    fn next_batch(&self) -> Vec<&'a KeyFrameEntry> {
        let mut batch = Vec::new();
        for entry in
            self.log.events.iter_from(self.events.len()).map_while(Event::key_frame).take(MOST_AT_A_TIME)
        {
            batch.push(entry);
            if self
                .log
                .frame(entry.frame)
                .is_some_and(|frame| self.map.ghost_removal.is_due(frame.map_time()))
            {
                break;
            }
        }
        batch
    }

    /// Maps key frames again: the cloud beside the other maps.
    fn map_batch(&mut self, batch: &[&KeyFrameEntry], context: &MappingContext<'_>) -> Result<(), Error> {
        let history = &self.log.history;
        let observations = crate::parallel::map(batch.to_vec(), |entry| history.get(entry.observation));
        let observations = observations.into_iter().collect::<Result<Vec<_>, _>>()?;
        let views = || observations.iter().map(|observation| KeyFrameView::of(observation));
        let poses = || batch.iter().map(|entry| &self.poses[entry.frame.get() as usize]);
        let (cloud, mut others) = self.map.split();
        let map_clouds = || views().zip(poses()).map(|(view, pose)| view.map_cloud(cloud, pose)).collect();
        let map_others = || {
            let mut clock = StageClock::start();
            let updates = views()
                .zip(poses())
                .map(|(view, pose)| view.map_others(&mut others, pose, context, &mut clock));
            updates.collect()
        };
        let (clouds, updates): (Result<Vec<_>, _>, Result<Vec<_>, _>) =
            crate::parallel::join(map_clouds, map_others);
        for ((entry, cloud), update) in batch.iter().zip(clouds?).zip(updates?) {
            let seen = SeenThings::of(&update.with_cloud(cloud));
            self.events.push(Event::KeyFrame(KeyFrameEntry { seen, ..KeyFrameEntry::clone(entry) }));
        }
        if let Some(last) = observations.last() {
            self.map.remove_ghosts_when_due(last.frame.timestamp());
        }
        self.snapshots.take_when_due(batch.len(), &self.map, &self.events);
        Ok(())
    }

    /// Lets something else than a key frame happen again.
    fn happen_again(&mut self, event: &Event, context: &MappingContext<'_>) -> Result<(), Error> {
        let event = match event {
            // A batch of them is mapped at a time.
            Event::KeyFrame(_) => event.clone(),
            Event::Scan(entry) => {
                let place = entry.frame.get() as usize;
                let Some((frame, pose)) = self.log.frame(entry.frame).zip(self.poses.get(place)) else {
                    return Err(Error::UnknownFrame { frame: entry.frame });
                };
                let points = self.log.history.scan(entry.points)?;
                let scan = Scan { timestamp: frame.map_time(), points: &points, world_from_sensor: pose };
                let (map, clock) = (&mut self.map, &mut StageClock::start());
                self.scan_mapper.map(&scan, map, context.sensor, clock)?;
                event.clone()
            }
            Event::Settled => {
                self.map.remove_ghosts();
                Event::Settled
            }
            &Event::Forgot { newest, center, radius } => {
                if let Some(pose) = self.pose(newest) {
                    self.map.forget_outside(pose.transform_point(center), radius);
                }
                event.clone()
            }
            Event::Held { object, is_held } => {
                if let Some(now) = object.object(&self.events, self.map.objects()) {
                    if *is_held {
                        self.map.objects.hold(now)
                    } else {
                        self.map.objects.release(now)
                    };
                }
                event.clone()
            }
            Event::Moved { newest, object, motion } => {
                let now = object.object(&self.events, self.map.objects());
                if let Some((now, pose)) = now.zip(self.pose(*newest)) {
                    self.map.move_body(now, &motion.seen_from(&pose))?;
                }
                event.clone()
            }
        };
        self.events.push(event);
        Ok(())
    }

    fn pose(&self, frame: FrameId) -> Option<Pose> {
        self.poses.get(frame.get() as usize).copied()
    }

    /// For each observation of a key frame of both maps, what it was called and what it is called.
    fn pairs(&self) -> impl Iterator<Item = (&'a SeenThings, &SeenThings)> {
        let entries = self.events.iter().filter_map(Event::key_frame);
        self.log.key_frames().map(|entry| &entry.seen).zip(entries.map(|entry| &entry.seen))
    }

    fn shared_planes(&self) -> impl Iterator<Item = (PlaneId, PlaneId)> {
        self.pairs().flat_map(|(old, new)| old.planes.iter().copied().zip(new.planes.iter().copied()))
    }

    fn shared_objects(&self) -> impl Iterator<Item = (ObjectId, ObjectId)> {
        self.pairs().flat_map(|(old, new)| {
            old.objects.iter().filter_map(|&(detection, id)| {
                let place = new.objects.binary_search_by_key(&detection, |&(detection, _)| detection).ok()?;
                Some((id, new.objects[place].1))
            })
        })
    }

    /// Gives planes and objects the ids that they had, and says what has become of them.
    fn finish(mut self) -> Rebuilt {
        let (before, now) = (self.before, &self.map);
        let planes = Identities::of(self.shared_planes().filter_map(|(old, new)| {
            Some((before.planes.current_id(old).unwrap_or(old), now.planes.current_id(new)?))
        }));
        let objects = Identities::of(self.shared_objects().filter_map(|(old, new)| {
            Some((before.objects().current_id(old), now.objects().object(new)?.id()))
        }));
        let mut plane_ids = Succession::new(
            planes.names_of_all(self.shared_planes()),
            [before.planes.ids_given(), now.planes.ids_given()],
            PlaneId::new,
        );
        let mut object_ids = Succession::new(
            objects.names_of_all(self.shared_objects()),
            [before.objects.ids_given(), now.objects.ids_given()],
            ObjectId::new,
        );
        for entry in self.events.iter_mut().filter_map(Event::key_frame_mut) {
            entry.seen.rename(&mut plane_ids, &mut object_ids);
        }
        self.map.objects.succeed(&before.objects, &mut object_ids, &objects.merged, &mut plane_ids);
        self.map.planes.succeed(&before.planes, &mut plane_ids, &planes.merged);
        let is_in_map = |object| self.map.objects().object(object).is_some();
        let entries = self.events.iter_mut().filter_map(Event::key_frame_mut);
        for (old, new) in self.log.key_frames().zip(entries) {
            new.seen.remember(&old.seen, is_in_map);
        }
        Rebuilt {
            planes: planes_changed(&planes, &plane_ids, before, &self.map),
            objects: objects_changed(&objects, &object_ids, before, &self.map),
            map: self.map,
            events: self.events,
        }
    }
}

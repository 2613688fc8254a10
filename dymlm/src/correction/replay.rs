use std::collections::BTreeMap;

use dymlm_core::{FrameId, ObjectId, PlaneId, Pose};

use super::identities::Identities;
use super::report::{CorrectionProgress, ThingChanges};
use super::thing_changes::{objects_changed, planes_changed};
use crate::ghost_removal::GhostRemoval;
use crate::key_frame_view::{KeyFrameView, MappingContext};
use crate::scans::{Scan, ScanMapper};
use crate::session_log::{Event, KeyFrameEntry, MovedBody, SeenThings, SessionLog};
use crate::stages::StageClock;
use crate::{Error, MultiLevelMap};

/// Key frames that are unpacked at a time, at most: more wait less for each other, and take more memory.
const MOST_AT_A_TIME: usize = 16;

/// Builds the maps again from what key frames have shown, at other poses.
pub(super) struct Replay<'a> {
    log: &'a SessionLog,
    /// The pose of each frame, by its id.
    poses: &'a [Pose],
    before: &'a MultiLevelMap,
    pub(super) map: MultiLevelMap,
    pub(super) ghost_removal: GhostRemoval,
    /// What has happened, with what the key frames see in the new maps.
    events: Vec<Event>,
    scan_mapper: ScanMapper,
}

/// Maps that were built again, and what has become of what was in them.
pub(crate) struct Rebuilt {
    pub(crate) map: MultiLevelMap,
    pub(crate) ghost_removal: GhostRemoval,
    pub(crate) events: Vec<Event>,
    pub(crate) planes: ThingChanges<PlaneId>,
    pub(crate) objects: ThingChanges<ObjectId>,
}

impl<'a> Replay<'a> {
    pub(super) fn new(
        log: &'a SessionLog,
        poses: &'a [Pose],
        before: &'a MultiLevelMap,
        empty: MultiLevelMap,
    ) -> Self {
        Self {
            log,
            poses,
            before,
            map: empty,
            ghost_removal: GhostRemoval::default(),
            events: Vec::with_capacity(log.events.len()),
            scan_mapper: ScanMapper::default(),
        }
    }

    /// Lets everything happen again. `watch` is told before each few key frames how many will have been
    /// mapped then, and says whether to go on.
    pub(super) fn run(
        mut self,
        context: &MappingContext<'_>,
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<Rebuilt, Error> {
        let mut progress = CorrectionProgress { done: 0, total: self.log.key_frames().count() };
        let mut rest = self.log.events.as_slice();
        while let Some(event) = rest.first() {
            let batch = self.next_batch(rest);
            if batch.is_empty() {
                self.happen_again(event, context)?;
                rest = &rest[1..];
                continue;
            }
            progress.done += batch.len();
            if !watch(progress) {
                return Err(Error::Cancelled);
            }
            self.map_batch(&batch, context)?;
            rest = &rest[batch.len()..];
        }
        Ok(self.finish())
    }

    /// The key frames that come next, up to one after which ghosts are removed: until then no map asks
    /// another thread's.
    fn next_batch(&self, rest: &'a [Event]) -> Vec<&'a KeyFrameEntry> {
        let mut batch = Vec::new();
        for entry in rest.iter().map_while(Event::key_frame).take(MOST_AT_A_TIME) {
            batch.push(entry);
            if self.log.frame(entry.frame).is_some_and(|frame| self.ghost_removal.is_due(frame.timestamp)) {
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
            self.ghost_removal.run_when_due(last.frame.timestamp(), &mut self.map);
        }
        Ok(())
    }

    /// Lets something else than a key frame happen again.
    fn happen_again(&mut self, event: &Event, context: &MappingContext<'_>) -> Result<(), Error> {
        let event = match event {
            // A batch of them is mapped at a time.
            Event::KeyFrame(_) => return Ok(()),
            Event::Scan(entry) => {
                let place = entry.frame.get() as usize;
                let Some((frame, pose)) = self.log.frame(entry.frame).zip(self.poses.get(place)) else {
                    return Ok(());
                };
                let scan =
                    Scan { timestamp: frame.timestamp, points: &entry.points, world_from_sensor: pose };
                let (map, clock) = (&mut self.map, &mut StageClock::start());
                self.scan_mapper.map(&scan, map, &mut self.ghost_removal, context.sensor, clock)?;
                event.clone()
            }
            Event::Settled => {
                self.ghost_removal.run(&mut self.map);
                Event::Settled
            }
            &Event::Forgot { newest, center, radius } => {
                let center = self.motion_at(newest).map_or(center, |motion| motion.transform_point(center));
                self.map.forget_outside(center, radius);
                Event::Forgot { newest, center, radius }
            }
            &Event::Held { object, is_held } => {
                let Some(object) = self.object_now(object) else { return Ok(()) };
                if is_held {
                    self.map.objects.hold(object);
                } else {
                    self.map.objects.release(object);
                }
                Event::Held { object, is_held }
            }
            Event::Moved { newest, body } => {
                let Some(object) = self.object_now(body.object) else { return Ok(()) };
                let body = MovedBody { object, ..body.clone() };
                let body =
                    self.motion_at(*newest).map_or(body.clone(), |motion| body.in_moved_world(&motion));
                self.map.move_body(&body)?;
                Event::Moved { newest: *newest, body }
            }
        };
        self.events.push(event);
        Ok(())
    }

    /// How the world has moved where a frame was taken; `None` when it has not.
    fn motion_at(&self, frame: FrameId) -> Option<Pose> {
        let before = self.log.frame(frame)?.world_from_camera;
        let now = *self.poses.get(frame.get() as usize)?;
        (before != now).then(|| now * before.inverse())
    }

    /// What an object of before is in the map as far as it is built.
    fn object_now(&self, object: ObjectId) -> Option<ObjectId> {
        let object = self.before.objects().current_id(object);
        let mut shared: BTreeMap<ObjectId, usize> = BTreeMap::new();
        for (old, new) in self.shared_objects() {
            if self.before.objects().current_id(old) == object && self.map.objects().object(new).is_some() {
                *shared.entry(self.map.objects().current_id(new)).or_default() += 1;
            }
        }
        // The oldest of equals.
        shared.into_iter().rev().max_by_key(|&(_, count)| count).map(|(id, _)| id)
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
        let plane_names = self.map.planes.succeed(&before.planes, &planes.names, &planes.merged);
        let object_names =
            self.map.objects.succeed(&before.objects, &objects.names, &objects.merged, &plane_names);
        for event in &mut self.events {
            event.rename(&plane_names, &object_names);
        }
        let entries = self.events.iter_mut().filter_map(Event::key_frame_mut);
        for (old, new) in self.log.key_frames().zip(entries) {
            new.seen.remember(&old.seen, |object| self.map.objects().object(object).is_some());
        }
        Rebuilt {
            planes: planes_changed(&planes, &plane_names, before, &self.map),
            objects: objects_changed(&objects, &object_names, before, &self.map),
            map: self.map,
            ghost_removal: self.ghost_removal,
            events: self.events,
        }
    }
}

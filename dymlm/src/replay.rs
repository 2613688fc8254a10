use std::collections::VecDeque;
use std::sync::Arc;

use dymlm_core::{FrameId, Pages, Pose};
use dymlm_history::Observation;

use crate::key_frame_view::{KeyFrameView, MappingContext, SplitMaps};
use crate::map_pager::MapPager;
use crate::scans::{Scan, ScanMapper};
use crate::session_log::{Event, KeyFrameEntry, SeenThings, SessionLog};
use crate::snapshots::{Snapshots, Steps};
use crate::stages::StageClock;
use crate::{CorrectionProgress, Error, MultiLevelMap};

/// Most key frames that are mapped at a time, and most that are unpacked meanwhile: with more, threads wait
/// less for each other and take more memory.
const MOST_AT_A_TIME: usize = 8;

/// Builds maps again from what key frames have shown, at other poses or in another order, starting from a
/// state that is still right.
pub(crate) struct Replay<'a> {
    log: &'a SessionLog,
    /// The pose of each frame, by its id.
    poses: &'a [Pose],
    /// The maps so far, without their past.
    map: MultiLevelMap,
    /// What has happened, with what the key frames have seen in the new maps.
    events: Pages<Event>,
    /// The observations of the key frames that come next, unpacked while those before were mapped.
    unpacked: VecDeque<Arc<Observation>>,
    snapshots: &'a mut Snapshots,
    scan_mapper: ScanMapper,
    pager: MapPager,
}

impl<'a> Replay<'a> {
    /// Begins with maps in which `events` have happened.
    pub(crate) fn new(
        log: &'a SessionLog,
        poses: &'a [Pose],
        mut map: MultiLevelMap,
        events: Pages<Event>,
        snapshots: &'a mut Snapshots,
    ) -> Result<Self, Error> {
        map.cloud.part_from_clones();
        // The log stays with the maps of before, and what it holds in memory counts.
        let pager = MapPager::new(&map.config.memory, || log.memory_bytes())?;
        let (unpacked, scan_mapper) = (VecDeque::new(), ScanMapper::default());
        Ok(Self { log, poses, map, events, unpacked, snapshots, scan_mapper, pager })
    }

    /// The maps so far, without their past.
    pub(crate) fn map(&self) -> &MultiLevelMap {
        &self.map
    }

    /// Replays all events that follow. `watch` is told before each batch of key frames and before each scan
    /// how many of both will have been mapped after it, and returns whether to go on.
    pub(crate) fn run(
        mut self,
        context: &MappingContext<'_>,
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<(MultiLevelMap, Pages<Event>), Error> {
        self.run_to(self.log.events.len(), context, watch)?;
        Ok((self.map, self.events))
    }

    /// Replays the events that follow up to event `end`.
    pub(crate) fn run_to(
        &mut self,
        end: usize,
        context: &MappingContext<'_>,
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<(), Error> {
        let start = self.events.len();
        let rest = || self.log.events.iter_from(start).take(end.saturating_sub(start));
        let mut progress = CorrectionProgress { done: 0, total: rest().filter_map(Event::mapped).count() };
        let mut steps = Steps::after(&self.log.events, start);
        let mut following = steps.count(rest());
        while let Some(event) = self.log.events.get(self.events.len()).filter(|_| self.events.len() < end) {
            let batch = self.next_batch(end);
            for _ in 0..batch.len().max(1) {
                self.pager.page_out(&mut self.map, self.snapshots)?;
            }
            let mapped = if batch.is_empty() { usize::from(event.mapped().is_some()) } else { batch.len() };
            progress.done += mapped;
            if mapped > 0 && !watch(progress) {
                return Err(Error::Cancelled);
            }
            if batch.is_empty() {
                self.replay_event(event, context)?;
            } else {
                self.map_batch(&batch, end, context)?;
            }
            let begun = usize::from(steps.begins(event)).max(batch.len());
            following -= begun;
            self.snapshots.take_in_replay_when_due(begun, following, &self.map, &self.events);
        }
        Ok(())
    }

    /// The key frames that come next, before any other event and before event `end`.
    fn next_key_frames(&self, end: usize) -> impl Iterator<Item = &'a KeyFrameEntry> + use<'a> {
        let most = end.saturating_sub(self.events.len());
        self.log.events.iter_from(self.events.len()).map_while(Event::key_frame).take(most)
    }

    /// The key frames that are mapped next, up to one after which ghosts are removed: until then no map reads
    /// a map that another thread builds.
    fn next_batch(&self, end: usize) -> Vec<&'a KeyFrameEntry> {
        let mut batch = Vec::new();
        for entry in self.next_key_frames(end).take(MOST_AT_A_TIME) {
            batch.push(entry);
            let frame = self.log.frame(entry.frame);
            if frame.is_some_and(|frame| self.map.ghost_removal.is_due(frame.map_time())) {
                break;
            }
        }
        batch
    }

    /// Maps key frames again, the cloud in parallel with the other maps, and unpacks those that follow: last,
    /// so that it keeps the thread busy that is done with its maps first.
    fn map_batch(
        &mut self,
        batch: &[&KeyFrameEntry],
        end: usize,
        context: &MappingContext<'_>,
    ) -> Result<(), Error> {
        let observations = self.take_observations(batch)?;
        let (log, known) = (self.log, batch.len() + self.unpacked.len());
        let following = self.next_key_frames(end).take(batch.len() + MOST_AT_A_TIME).skip(known).collect();
        let views = || observations.iter().map(|observation| KeyFrameView::of(observation));
        let poses = || batch.iter().map(|entry| &self.poses[entry.frame.get() as usize]);
        let SplitMaps { cloud, octree, mut things } = self.map.split();
        let map_clouds =
            || views().zip(poses()).try_for_each(|(view, pose)| view.map_cloud(cloud, pose).map(|_| ()));
        let map_others = || {
            let mut clock = StageClock::start();
            let reports = views().zip(poses()).map(|(view, pose)| {
                view.map_octree(octree, pose, context)?;
                view.map_things(&mut things, pose, context, &mut clock)
            });
            reports.collect::<Result<Vec<_>, Error>>()
        };
        let (clouds, (things, unpacked)) = crate::parallel::join(map_clouds, || {
            crate::parallel::join(map_others, || unpack(log, following))
        });
        clouds?;
        self.unpacked.extend(unpacked?);
        for (entry, (planes, objects)) in batch.iter().zip(things?) {
            let seen = SeenThings::of(&planes, &objects);
            self.events.push(Event::KeyFrame(KeyFrameEntry { seen, ..KeyFrameEntry::clone(entry) }));
        }
        if let Some(last) = observations.last() {
            self.map.remove_ghosts_when_due(last.frame.timestamp());
        }
        Ok(())
    }

    /// The observations of the key frames that are mapped next: unpacked already, but for the first of all and
    /// the first after another event.
    fn take_observations(&mut self, batch: &[&KeyFrameEntry]) -> Result<Vec<Arc<Observation>>, Error> {
        let missing = batch.iter().skip(self.unpacked.len()).copied().collect();
        self.unpacked.extend(unpack(self.log, missing)?);
        Ok(self.unpacked.drain(..batch.len()).collect())
    }

    /// Replays an event that is no key frame.
    fn replay_event(&mut self, event: &Event, context: &MappingContext<'_>) -> Result<(), Error> {
        let event = match event {
            // Key frames are mapped in batches.
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
            Event::SessionBegan { .. } => {
                self.map.begin_session();
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
}

/// Unpacks the observations of key frames.
fn unpack(log: &SessionLog, entries: Vec<&KeyFrameEntry>) -> Result<Vec<Arc<Observation>>, Error> {
    crate::parallel::map(entries, |entry| log.observation(entry)).into_iter().collect()
}

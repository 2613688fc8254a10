use dymlm_core::Pages;

use crate::MultiLevelMap;
use crate::session_log::{Event, event_bytes_beside};

/// Number of [steps](Steps) from one snapshot to the next.
const INTERVAL: usize = 5;
/// Number of intervals for which every second snapshot is kept, and for which the others are. A local
/// optimization moves the last ten steps or so; older snapshots would share less and less with the maps, and
/// take their memory once more.
const LIVES: [u64; 2] = [6, 3];
/// Number of steps for which a snapshot is kept at most.
const LONGEST_LIFE: usize = INTERVAL * LIVES[0] as usize;
/// Number of steps without a late correction after which no more snapshots are taken.
const PATIENCE: usize = 300;
/// Number of scans after a key frame that belong to its step: a lidar that turns ten times a second, beside a
/// camera that gives a key frame a second. Further ones count by themselves, as without a camera.
const SCANS_OF_A_STEP: usize = 10;

/// Tells the steps of a session, by which a SLAM optimizes its last poses: its key frames, with the scans between
/// them, or the scans of a lidar alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steps {
    /// Number of scans since the last key frame.
    scans: usize,
}

impl Default for Steps {
    fn default() -> Self {
        Self { scans: SCANS_OF_A_STEP }
    }
}

impl Steps {
    /// As they go on after the first `count` events.
    pub(crate) fn after(events: &Pages<Event>, count: usize) -> Self {
        let mut steps = Self::default();
        let first = count.saturating_sub(SCANS_OF_A_STEP + 1);
        events.iter_from(first).take(count - first).for_each(|event| _ = steps.begins(event));
        steps
    }

    /// Whether the next event begins a step.
    pub(crate) fn begins(&mut self, event: &Event) -> bool {
        match event {
            Event::KeyFrame(_) => self.scans = 0,
            Event::Scan(_) => self.scans = self.scans.saturating_add(1),
            _ => return false,
        }
        self.scans == 0 || self.scans > SCANS_OF_A_STEP
    }

    /// The number of steps that some events begin.
    pub(crate) fn count<'a>(mut self, events: impl Iterator<Item = &'a Event>) -> usize {
        events.filter(|event| self.begins(event)).count()
    }
}

/// The maps as they were in the middle of a session: a state from which the session can be replayed.
#[derive(Debug)]
pub(crate) struct Snapshot {
    /// The maps, without their past.
    pub(crate) map: MultiLevelMap,
    /// What had happened, with the ids that things have in these maps.
    pub(crate) events: Pages<Event>,
    number: u64,
}

/// Some recent states of the session, the closer together the younger they are, so that a correction of the
/// last steps replays not many more than those. They share with the maps what has not changed since.
///
/// They are taken from the first such correction on, since what they share is copied when it changes: callers
/// who only close loops should not pay for that, and a SLAM that optimizes its last frames does so from its
/// first seconds on. A session that goes on with maps begins with a snapshot: otherwise an early correction
/// would map all sessions before again.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    /// The oldest first.
    taken: Vec<Snapshot>,
    /// Number of steps since the last snapshot.
    since: usize,
    /// Number of steps for which snapshots are still taken if no correction uses them.
    patience: usize,
    steps: Steps,
}

impl Snapshots {
    /// Begins with a snapshot of the maps that a session starts from, in which `events` have happened: an
    /// early correction then need not replay the sessions before.
    pub(crate) fn at_the_beginning_of(map: &MultiLevelMap, events: &Pages<Event>) -> Self {
        let beginning = Snapshot { map: map.without_past(), events: events.clone(), number: 1 };
        Self { taken: vec![beginning], since: 0, patience: PATIENCE, steps: Steps::default() }
    }

    /// Takes a snapshot of the maps, in which `events` have happened, when enough steps have been mapped since
    /// the last one, and drops old ones. Must be called after each key frame and each scan, the last event.
    pub(crate) fn take_when_due(&mut self, map: &MultiLevelMap, events: &Pages<Event>) {
        let last = events.len().checked_sub(1).and_then(|last| events.get(last));
        if !last.is_some_and(|event| self.steps.begins(event)) {
            return;
        }
        self.patience = self.patience.saturating_sub(1);
        if self.patience == 0 {
            self.taken.clear();
            return;
        }
        self.take(1, map, events);
    }

    /// The same in a replay, which has mapped so many steps again, and of which `following` are yet to come:
    /// snapshots that would be dropped before its end are not taken. What it maps is not new, and tries nobody's
    /// patience.
    pub(crate) fn take_in_replay_when_due(
        &mut self,
        replayed: usize,
        following: usize,
        map: &MultiLevelMap,
        events: &Pages<Event>,
    ) {
        if self.patience > 0 && following < LONGEST_LIFE {
            self.take(replayed, map, events);
        }
    }

    fn take(&mut self, steps: usize, map: &MultiLevelMap, events: &Pages<Event>) {
        self.since += steps;
        if self.since < INTERVAL {
            return;
        }
        self.since = 0;
        let number = self.taken.last().map_or(1, |last| last.number + 1);
        self.taken.push(Snapshot { map: map.without_past(), events: events.clone(), number });
        self.taken.retain(|snapshot| number - snapshot.number < LIVES[(snapshot.number % 2) as usize]);
    }

    /// Notes a correction after whose first change so many steps have come.
    pub(crate) fn note_correction(&mut self, steps: usize) {
        if steps <= LONGEST_LIFE {
            self.patience = PATIENCE;
        }
    }

    /// Frees the memory of what the maps have paged out.
    pub(crate) fn page_out_like(&mut self, map: &MultiLevelMap) {
        for snapshot in &mut self.taken {
            snapshot.map.cloud.page_out_like(&map.cloud);
        }
    }

    pub(crate) fn newest(&self) -> Option<&Snapshot> {
        self.taken.last()
    }

    /// Drops the snapshots that were taken after an event, because the event has changed.
    pub(crate) fn forget_behind(&mut self, event: usize) {
        self.taken.retain(|snapshot| snapshot.events.len() <= event);
        self.since = 0;
    }

    /// Approximate bytes that snapshots hold besides what they share with each other and with the maps.
    pub(crate) fn memory_bytes(&self, map: &MultiLevelMap) -> usize {
        let none = Pages::default();
        let events = map.past.log.as_ref().map_or(&none, |log| &log.events);
        let newer = self.taken.iter().skip(1).map(|snapshot| (&snapshot.map, &snapshot.events));
        let bytes = |(Snapshot { map, events, .. }, (newer, newer_events)): (&Snapshot, (&_, &_))| {
            map.memory_beside(newer).total() + event_bytes_beside(events, newer_events)
        };
        self.taken.iter().zip(newer.chain([(map, events)])).map(bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use dymlm_core::FrameId;

    use super::*;
    use crate::session_log::{KeyFrameEntry, ScanEntry, SeenThings};

    fn key_frame() -> Event {
        Event::KeyFrame(KeyFrameEntry { frame: FrameId::new(0), observation: 0, seen: SeenThings::default() })
    }

    fn scan() -> Event {
        Event::Scan(ScanEntry { frame: FrameId::new(0), points: 0 })
    }

    #[test]
    fn the_last_key_frames_are_near_a_snapshot_with_ten_scans_between_them_too() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        for scans in [0, 1, 3, 10] {
            let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
            for _ in 0..200 {
                for event in std::iter::once(key_frame()).chain((0..scans).map(|_| scan())) {
                    events.push(event);
                    let ten = events.len().saturating_sub(10 * (scans + 1));
                    snapshots.note_correction(Steps::after(&events, ten).count(events.iter_from(ten)));
                    snapshots.take_when_due(&map, &events);
                }
            }
            assert!(snapshots.taken.len() <= 5, "{} for {scans} scans", snapshots.taken.len());
            let first = events.len() - 10 * (scans + 1);
            snapshots.forget_behind(first);
            let start = snapshots.newest().map_or(0, |snapshot| snapshot.events.len());
            assert!(first - start <= 10 * (scans + 1), "{scans} scans: from {start} of {first}");
        }
    }

    #[test]
    fn scans_count_where_no_key_frames_come_between_them() {
        let mut events = Pages::default();
        let mut push = |event: Event, count: usize| (0..count).for_each(|_| events.push(event.clone()));
        push(scan(), 7);
        push(key_frame(), 2);
        push(Event::Settled, 1);
        push(scan(), 25);
        let steps = |first: usize| Steps::after(&events, first).count(events.iter_from(first));
        assert_eq!([0, 7, 9, 20, 34].map(steps), [24, 17, 15, 15, 1]);
    }

    #[test]
    fn the_younger_the_closer() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
        for key_frames in 1..=500 {
            snapshots.note_correction(10);
            events.push(key_frame());
            snapshots.take_when_due(&map, &events);
            assert!(snapshots.taken.len() <= 5, "{}", snapshots.taken.len());
            for changed in 1..=20.min(key_frames) {
                let first = key_frames - changed;
                let lengths = || snapshots.taken.iter().map(|snapshot| snapshot.events.len());
                let start = lengths().filter(|&length| length <= first).max().unwrap_or(0);
                assert!(first - start <= changed.max(INTERVAL), "{key_frames}: {changed} from {start}");
            }
        }
    }

    #[test]
    fn a_replay_of_any_length_leaves_those_that_the_next_correction_needs() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
        snapshots.note_correction(10);
        let all = 3 * PATIENCE;
        for following in (0..all).rev() {
            events.push(key_frame());
            snapshots.take_in_replay_when_due(1, following, &map, &events);
            assert!(snapshots.taken.is_empty() || following < LONGEST_LIFE);
        }
        snapshots.forget_behind(all - 10);
        assert!(snapshots.newest().is_some_and(|snapshot| snapshot.events.len() >= all - 20));
    }

    #[test]
    fn none_are_taken_for_who_does_not_use_them() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
        events.push(key_frame());
        let insert = |snapshots: &mut Snapshots, key_frames: usize| {
            for _ in 0..key_frames {
                snapshots.take_when_due(&map, &events);
            }
            snapshots.taken.len()
        };
        assert_eq!(insert(&mut snapshots, 100), 0);
        snapshots.note_correction(100);
        assert_eq!(insert(&mut snapshots, 100), 0);
        snapshots.note_correction(10);
        assert!(insert(&mut snapshots, 100) > 3);
        assert_eq!(insert(&mut snapshots, PATIENCE), 0);
    }
}

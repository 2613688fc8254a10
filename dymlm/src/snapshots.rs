use dymlm_core::Pages;

use crate::MultiLevelMap;
use crate::session_log::{Event, event_bytes_beside};

/// Number of key frames and scans from one snapshot to the next.
const INTERVAL: usize = 5;
/// Number of intervals for which every second snapshot is kept, and for which the others are. A local
/// optimization moves the last ten key frames or scans or so; older snapshots would share less and less with
/// the maps, and take their memory once more.
const LIVES: [u64; 2] = [6, 3];
/// Number of key frames and scans for which a snapshot is kept at most.
const LONGEST_LIFE: usize = INTERVAL * LIVES[0] as usize;
/// Number of key frames and scans without a late correction after which no more snapshots are taken.
const PATIENCE: usize = 300;

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
/// last key frames and scans replays not many more than those. They share with the maps what has not changed
/// since.
///
/// They are taken from the first such correction on, since what they share is copied when it changes: callers
/// who only close loops should not pay for that, and a SLAM that optimizes its last frames does so from its
/// first seconds on. A session that goes on with maps begins with a snapshot: otherwise an early correction
/// would map all sessions before again.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    /// The oldest first.
    taken: Vec<Snapshot>,
    /// Key frames and scans since the last snapshot.
    mapped: usize,
    /// Number of key frames and scans for which snapshots are still taken if no correction uses them.
    patience: usize,
}

impl Snapshots {
    /// Begins with a snapshot of the maps that a session starts from, in which `events` have happened: an
    /// early correction then need not replay the sessions before.
    pub(crate) fn at_the_beginning_of(map: &MultiLevelMap, events: &Pages<Event>) -> Self {
        let beginning = Snapshot { map: map.without_past(), events: events.clone(), number: 1 };
        Self { taken: vec![beginning], mapped: 0, patience: PATIENCE }
    }

    /// Takes a snapshot of the maps, in which `events` have happened, when enough key frames and scans have
    /// been mapped since the last one, and drops old ones. Must be called after each of them.
    pub(crate) fn take_when_due(&mut self, map: &MultiLevelMap, events: &Pages<Event>) {
        self.patience = self.patience.saturating_sub(1);
        if self.patience == 0 {
            self.taken.clear();
            return;
        }
        self.take(1, map, events);
    }

    /// The same in a replay, in which `following` key frames and scans are yet to be mapped again: snapshots
    /// that would be dropped before its end are not taken. What it maps is not new, and tries nobody's
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

    fn take(&mut self, newly_mapped: usize, map: &MultiLevelMap, events: &Pages<Event>) {
        self.mapped += newly_mapped;
        if self.mapped < INTERVAL {
            return;
        }
        self.mapped = 0;
        let number = self.taken.last().map_or(1, |last| last.number + 1);
        self.taken.push(Snapshot { map: map.without_past(), events: events.clone(), number });
        self.taken.retain(|snapshot| number - snapshot.number < LIVES[(snapshot.number % 2) as usize]);
    }

    /// Notes a correction after whose first change `mapped` key frames and scans have come.
    pub(crate) fn note_correction(&mut self, mapped: usize) {
        if mapped <= LONGEST_LIFE {
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
        self.mapped = 0;
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

    use super::*;

    #[test]
    fn the_younger_the_closer() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
        for key_frames in 1..=500 {
            snapshots.note_correction(10);
            events.push(Event::Settled);
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
        for key_frame in 1..=all {
            events.push(Event::Settled);
            snapshots.take_in_replay_when_due(1, all - key_frame, &map, &events);
            assert!(snapshots.taken.is_empty() || all - key_frame < LONGEST_LIFE);
        }
        snapshots.forget_behind(all - 10);
        assert!(snapshots.newest().is_some_and(|snapshot| snapshot.events.len() >= all - 20));
    }

    #[test]
    fn none_are_taken_for_who_does_not_use_them() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let mut snapshots = Snapshots::default();
        let insert = |snapshots: &mut Snapshots, key_frames: usize| {
            for _ in 0..key_frames {
                snapshots.take_when_due(&map, &Pages::default());
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

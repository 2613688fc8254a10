use dymlm_core::Pages;

use crate::session_log::Event;
use crate::{MapMemory, MultiLevelMap};

/// Key frames from one snapshot to the next.
const INTERVAL: usize = 5;
/// How many intervals each second snapshot is kept, and the others. A local optimization moves the last ten
/// key frames or so; older snapshots would share less and less with the maps, and take their memory once
/// more.
const LIVES: [u64; 2] = [6, 3];
/// Key frames after which nobody seems to correct late ones any more.
const PATIENCE: usize = 300;

/// The maps as they were in the middle of a session: a state from which it can happen again.
#[derive(Debug)]
pub(crate) struct Snapshot {
    /// Without their past.
    pub(crate) map: MultiLevelMap,
    /// What had happened, with the ids that its things have in these maps.
    pub(crate) events: Pages<Event>,
    number: u64,
}

/// Some late states of the session, the closer together the younger they are: so that a correction of the
/// last key frames maps not many more than those again. They share with the maps what has not changed since.
///
/// They are taken from the first such correction on, since what they share is copied when it changes: who
/// closes loops only shall not pay for it, and whose SLAM optimizes its last frames does so from its first
/// seconds on. A session that goes on with maps begins with one: to map all that was before again would take
/// the longer the more there was.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    /// The oldest first.
    taken: Vec<Snapshot>,
    /// Key frames since the last was taken.
    key_frames: usize,
    /// Key frames for which they are still taken when none is of use.
    patience: usize,
}

impl Snapshots {
    /// With the maps that a session begins with, of which these events are known: what is corrected soon need
    /// not happen again from the first session on.
    pub(crate) fn at_the_beginning_of(map: &MultiLevelMap, events: &Pages<Event>) -> Self {
        let beginning = Snapshot { map: map.without_past(), events: events.clone(), number: 1 };
        Self { taken: vec![beginning], key_frames: 0, patience: PATIENCE }
    }

    /// Takes a snapshot, of the maps after these events, when enough key frames have been mapped since the
    /// last, and drops those that are old.
    pub(crate) fn take_when_due(
        &mut self,
        new_key_frames: usize,
        map: &MultiLevelMap,
        events: &Pages<Event>,
    ) {
        self.patience = self.patience.saturating_sub(new_key_frames);
        if self.patience == 0 {
            self.taken.clear();
            return;
        }
        self.key_frames += new_key_frames;
        if self.key_frames < INTERVAL {
            return;
        }
        self.key_frames = 0;
        let number = self.taken.last().map_or(1, |last| last.number + 1);
        self.taken.push(Snapshot { map: map.without_past(), events: events.clone(), number });
        self.taken.retain(|snapshot| number - snapshot.number < LIVES[(snapshot.number % 2) as usize]);
    }

    /// Takes note of a correction that so many key frames are younger than what it changes.
    pub(crate) fn note_correction(&mut self, key_frames: usize) {
        if key_frames <= INTERVAL * LIVES[0] as usize {
            self.patience = PATIENCE;
        }
    }

    /// Gives memory free of what the maps have paged out.
    pub(crate) fn page_out_like(&mut self, map: &MultiLevelMap) {
        for snapshot in &mut self.taken {
            snapshot.map.cloud.page_out_like(&map.cloud);
        }
    }

    pub(crate) fn newest(&self) -> Option<&Snapshot> {
        self.taken.last()
    }

    /// Drops those that were taken after an event: it has changed.
    pub(crate) fn forget_behind(&mut self, event: usize) {
        self.taken.retain(|snapshot| snapshot.events.len() <= event);
        self.key_frames = 0;
    }

    /// Bytes that snapshots hold beside those that they share with the maps, about.
    pub(crate) fn memory_bytes(&self, map: &MultiLevelMap) -> usize {
        let newer = self.taken.iter().skip(1).map(|snapshot| &snapshot.map).chain([map]);
        let bytes = |(Snapshot { map, .. }, newer): (&Snapshot, &MultiLevelMap)| {
            let MapMemory { octree, planes, objects, .. } = map.memory();
            map.cloud.memory_bytes_beside(&newer.cloud) + octree + planes + objects
        };
        self.taken.iter().zip(newer).map(bytes).sum()
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
            snapshots.take_when_due(1, &map, &events);
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
    fn none_are_taken_for_who_does_not_use_them() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let mut snapshots = Snapshots::default();
        let insert = |snapshots: &mut Snapshots, key_frames: usize| {
            for _ in 0..key_frames {
                snapshots.take_when_due(1, &map, &Pages::default());
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

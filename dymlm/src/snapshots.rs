use std::sync::Arc;

use crate::ghost_removal::GhostRemoval;
use crate::session_log::Event;
use crate::{MapMemory, MultiLevelMap};

/// Key frames from one snapshot to the next.
const INTERVAL: usize = 5;
/// How many intervals each second snapshot is kept, and the others. A local optimization moves the last ten key
/// frames or so; older snapshots would share less and less with the maps, and take their memory once more.
const LIVES: [u64; 2] = [6, 3];
/// Key frames after which nobody seems to correct late ones any more.
const PATIENCE: usize = 300;

/// The maps as they were in the middle of a session, and how far it had come.
#[derive(Debug, Clone)]
pub(crate) struct SessionState {
    pub(crate) map: MultiLevelMap,
    pub(crate) ghost_removal: GhostRemoval,
    /// Events that had happened.
    pub(crate) length: usize,
}

impl SessionState {
    /// Nothing has happened.
    pub(crate) fn beginning(empty: MultiLevelMap) -> Self {
        let ghost_removal = GhostRemoval::default();
        Self { map: empty, ghost_removal, length: 0 }
    }
}

/// A state of the session from which it can happen again.
#[derive(Debug)]
pub(crate) struct Snapshot {
    pub(crate) state: SessionState,
    /// What had happened, with the ids that its things have in this state's maps; `None` as long as the log
    /// calls them the same.
    events: Option<Arc<[Event]>>,
    number: u64,
}

impl Snapshot {
    /// The events before it, with the ids of its maps.
    pub(crate) fn events<'a>(&'a self, log: &'a [Event]) -> &'a [Event] {
        &self.events.as_deref().unwrap_or(log)[..self.state.length]
    }
}

/// Some late states of the session, the closer together the younger they are: so that a correction of the
/// last key frames maps not many more than those again. They share with the maps what has not changed since.
///
/// They are taken from the first such correction on, since what they share is copied when it changes: who closes
/// loops only shall not pay for it, and whose SLAM optimizes its last frames does so from its first seconds on.
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
    /// Takes a snapshot, of the maps after so many events, when enough key frames have been mapped since the
    /// last, and drops those that are old.
    pub(crate) fn take_when_due(
        &mut self,
        new_key_frames: usize,
        map: &MultiLevelMap,
        ghost_removal: &GhostRemoval,
        length: usize,
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
        let state = SessionState { map: map.clone(), ghost_removal: ghost_removal.clone(), length };
        self.taken.push(Snapshot { state, events: None, number });
        self.taken.retain(|snapshot| number - snapshot.number < LIVES[(snapshot.number % 2) as usize]);
    }

    /// Takes note of a correction that so many key frames are younger than what it changes.
    pub(crate) fn note_correction(&mut self, key_frames: usize) {
        if key_frames <= INTERVAL * LIVES[0] as usize {
            self.patience = PATIENCE;
        }
    }

    pub(crate) fn newest(&self) -> Option<&Snapshot> {
        self.taken.last()
    }

    /// Drops those that were taken after an event: it has changed.
    pub(crate) fn forget_behind(&mut self, event: usize) {
        self.taken.retain(|snapshot| snapshot.state.length <= event);
        self.key_frames = 0;
    }

    /// Bytes that snapshots hold beside those that they share with the maps, about.
    pub(crate) fn memory_bytes(&self, map: &MultiLevelMap) -> usize {
        let newer = self.taken.iter().skip(1).map(|snapshot| &snapshot.state.map).chain([map]);
        let bytes = |(Snapshot { state, .. }, newer): (&Snapshot, &MultiLevelMap)| {
            let MapMemory { octree, planes, objects, .. } = state.map.memory();
            state.map.cloud.memory_bytes_beside(&newer.cloud) + octree + planes + objects
        };
        self.taken.iter().zip(newer).map(bytes).sum()
    }

    /// Keeps the events as they are called in the snapshots that have no events of their own: the log is going
    /// to call things by other ids.
    pub(crate) fn keep_events(&mut self, log: &[Event]) {
        let without = || self.taken.iter().filter(|snapshot| snapshot.events.is_none());
        let Some(longest) = without().map(|snapshot| snapshot.state.length).max() else { return };
        let events: Arc<[Event]> = log[..longest].into();
        for snapshot in self.taken.iter_mut().filter(|snapshot| snapshot.events.is_none()) {
            snapshot.events = Some(Arc::clone(&events));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MapConfig;

    #[test]
    fn the_younger_the_closer() {
        let map = MultiLevelMap::new(&MapConfig::default()).unwrap();
        let mut snapshots = Snapshots::default();
        for key_frames in 1..=500 {
            snapshots.note_correction(10);
            snapshots.take_when_due(1, &map, &GhostRemoval::default(), key_frames);
            assert!(snapshots.taken.len() <= 5, "{}", snapshots.taken.len());
            for changed in 1..=20.min(key_frames) {
                let first = key_frames - changed;
                let lengths = || snapshots.taken.iter().map(|snapshot| snapshot.state.length);
                let start = lengths().filter(|&length| length <= first).max().unwrap_or(0);
                assert!(first - start <= changed.max(INTERVAL), "{key_frames}: {changed} from {start}");
            }
        }
    }

    #[test]
    fn none_are_taken_for_who_does_not_use_them() {
        let map = MultiLevelMap::new(&MapConfig::default()).unwrap();
        let mut snapshots = Snapshots::default();
        let insert = |snapshots: &mut Snapshots, key_frames: usize| {
            for _ in 0..key_frames {
                snapshots.take_when_due(1, &map, &GhostRemoval::default(), 0);
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

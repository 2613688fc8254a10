use dymlm_core::Pages;

use crate::MultiLevelMap;
use crate::session_log::{Event, event_bytes_beside};

/// Number of [steps](Steps) from one snapshot to the next, where they are closest.
const INTERVAL: usize = 5;
/// Number of intervals for which a snapshot with an odd number is kept. Each time that a number can be halved,
/// the snapshot is kept twice as long: so the older, the farther apart, and a correction replays at most twice
/// as many steps as have come since the first that it moves (`the_younger_the_closer`).
const LIFE: usize = 3;
/// Snapshots whose numbers can be halved so often are lasting ones: one in 80 steps.
const HALVINGS_OF_LASTING: u32 = 4;
/// Number of steps that a local optimization moves at most.
const LOCAL: usize = 30;
/// Number of steps without a local correction after which only lasting snapshots are taken.
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
    /// Number of steps of the session before it.
    steps: usize,
    /// The interval that it ends, which says how long it is kept.
    number: usize,
    /// Bytes of its cloud that the next lasting snapshot does not share, if they have been counted.
    unshared: Option<usize>,
}

/// Snapshots of maps that are being built again.
#[derive(Debug)]
pub(crate) struct TakenOut {
    taken: Vec<Snapshot>,
    /// Number of steps at which the replay begins.
    start: usize,
    /// Number of those that the maps have seen.
    done: usize,
}

/// Some earlier states of the session, the closer together the younger they are, so that a correction replays
/// not many more steps than have come since the first that it moves. They share with the maps what has not
/// changed since.
///
/// Lasting ones are taken all the time, since a loop may be closed at any time, and in a session of hours a
/// replay of all takes many minutes; they are dropped when they take too much memory. The ones between them are
/// taken from the first correction of the last steps on, since what they share is copied when it changes: callers
/// who only close loops should not pay for that, and a SLAM that optimizes its last frames does so from its first
/// seconds on. A session that goes on with maps begins with a snapshot: an early correction need not map the
/// sessions before again.
#[derive(Debug, Default)]
pub(crate) struct Snapshots {
    /// Whether any are taken.
    is_used: bool,
    /// The oldest first.
    taken: Vec<Snapshot>,
    /// Number of steps so far.
    done: usize,
    /// Number of steps for which snapshots between the lasting ones are still taken if no correction uses them.
    patience: usize,
    steps: Steps,
    /// Bytes of the cloud when a lasting snapshot was taken last.
    cloud_bytes: usize,
}

impl Snapshots {
    /// Those of a session that begins with empty maps.
    pub(crate) fn new() -> Self {
        Self { is_used: true, ..Self::default() }
    }

    /// Begins with a snapshot of the maps that a session starts from, in which `events` have happened.
    pub(crate) fn at_the_beginning_of(map: &MultiLevelMap, events: &Pages<Event>) -> Self {
        let mut snapshots = Self { patience: PATIENCE, ..Self::new() };
        snapshots.push(0, map, events);
        snapshots
    }

    /// Takes a snapshot of the maps, in which `events` have happened, when enough steps have been mapped since
    /// the last one, and drops old ones. Must be called after each key frame and each scan, the last event.
    pub(crate) fn take_when_due(&mut self, map: &MultiLevelMap, events: &Pages<Event>) {
        let last = events.len().checked_sub(1).and_then(|last| events.get(last));
        if last.is_some_and(|event| self.steps.begins(event)) {
            self.patience = self.patience.saturating_sub(1);
            self.take_in_replay_when_due(1, 0, map, events);
        }
    }

    /// The same in a replay, which has mapped so many steps again, and of which `following` are yet to come:
    /// snapshots that would be dropped before its end are not taken. What it maps is not new, and tries nobody's
    /// patience.
    pub(crate) fn take_in_replay_when_due(
        &mut self,
        mapped: usize,
        following: usize,
        map: &MultiLevelMap,
        events: &Pages<Event>,
    ) {
        let before = self.done / INTERVAL;
        self.done += mapped;
        let [now, end] = [self.done, self.done + following].map(|steps| steps / INTERVAL);
        // Of several numbers that have passed at once, the one that is kept longest.
        let Some(number) = (before + 1..=now).max_by_key(|&number| halvings(number)) else { return };
        let has_patience = self.patience > 0;
        let is_due = |number| has_patience || is_lasting(number);
        if self.is_used && is_due(number) && is_kept(number, end) {
            self.push(number, map, events);
        }
        self.keep(|snapshot| is_kept(snapshot.number, now) && is_due(snapshot.number));
        self.drop_costly(map);
    }

    /// Notes a correction after whose first change so many steps have come.
    pub(crate) fn note_correction(&mut self, steps: usize) {
        if steps <= LOCAL {
            self.patience = PATIENCE;
        }
    }

    fn push(&mut self, number: usize, map: &MultiLevelMap, events: &Pages<Event>) {
        if is_lasting(number) {
            self.cloud_bytes = map.cloud.memory_bytes();
            // The newest so far has another one after it now.
            if let Some(newest) = self.taken.iter_mut().rev().find(|it| is_lasting(it.number)) {
                newest.unshared = None;
            }
        }
        self.taken.push(Snapshot {
            map: map.without_past(),
            events: events.clone(),
            steps: self.done,
            number,
            unshared: None,
        });
    }

    /// Drops lasting snapshots until they take no more than half of what the cloud takes, or one is left.
    fn drop_costly(&mut self, map: &MultiLevelMap) {
        while let Some(costliest) = self.costliest(map) {
            self.keep(|snapshot| snapshot.number != costliest);
        }
    }

    /// The number of the lasting snapshot that takes most for what it spares, if they take too much.
    ///
    /// Without it, corrections that begin between it and the next one have as many more steps to replay as are
    /// between it and the one before; and the longer ago, the fewer begin there. In a building a snapshot takes
    /// what the camera saw about then, in a single room as much as the cloud. The beginning of a session stays
    /// as long as the snapshots of a local optimization do.
    fn costliest(&mut self, map: &MultiLevelMap) -> Option<usize> {
        let first = usize::from(self.patience > 0);
        let is_asked = |snapshot: &&Snapshot| is_lasting(snapshot.number) && snapshot.number >= first;
        if self.taken.iter().filter(is_asked).count() < 2 {
            return None;
        }
        self.count_unshared(map);
        let lasting: Vec<(usize, &Snapshot)> =
            self.taken.iter().filter(is_asked).filter_map(|it| it.unshared.zip(Some(it))).collect();
        let all: usize = lasting.iter().map(|(bytes, _)| bytes).sum();
        if all <= self.cloud_bytes / 2 {
            return None;
        }
        let before = std::iter::once(0).chain(lasting.iter().map(|(_, snapshot)| snapshot.steps));
        let costs = lasting.iter().zip(before).map(|((bytes, snapshot), before)| {
            let (age, spared) = (self.done - snapshot.steps, snapshot.steps - before);
            (*bytes as f64 * age as f64 / spared.max(1) as f64, snapshot.number)
        });
        costs.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, number)| number)
    }

    /// Counts what each lasting snapshot does not share with the next one, unless that is known, and the newest with
    /// the maps.
    fn count_unshared(&mut self, map: &MultiLevelMap) {
        let mut lasting = self.taken.iter_mut().filter(|snapshot| is_lasting(snapshot.number)).rev();
        let Some(newest) = lasting.next() else { return };
        newest.unshared = Some(newest.map.cloud.memory_bytes_beside(&map.cloud));
        let mut next = &newest.map;
        for Snapshot { map, unshared, .. } in lasting {
            unshared.get_or_insert_with(|| map.cloud.memory_bytes_beside(&next.cloud));
            next = map;
        }
    }

    /// Drops the others.
    fn keep(&mut self, is_kept: impl Fn(&Snapshot) -> bool) {
        let lasting = |taken: &[Snapshot]| taken.iter().filter(|it| is_lasting(it.number)).count();
        let before = lasting(&self.taken);
        self.taken.retain(is_kept);
        // What lasting ones share with each other, the others have no part in.
        if lasting(&self.taken) < before {
            self.forget_counts();
        }
    }

    fn forget_counts(&mut self) {
        self.taken.iter_mut().for_each(|snapshot| snapshot.unshared = None);
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

    /// Before a replay from the newest that is left: takes out the snapshots behind an event, because the event has
    /// changed.
    pub(crate) fn take_out_behind(&mut self, event: usize) -> TakenOut {
        let first = self.taken.partition_point(|snapshot| snapshot.events.len() <= event);
        let taken = self.taken.split_off(first);
        let start = self.newest().map_or(0, |snapshot| snapshot.steps);
        TakenOut { taken, start, done: std::mem::replace(&mut self.done, start) }
    }

    /// After a replay that has failed: the maps have stayed, and so do their snapshots, instead of those that the
    /// replay has taken.
    pub(crate) fn put_back(&mut self, TakenOut { taken, start, done }: TakenOut) {
        self.keep(|snapshot| snapshot.steps <= start);
        self.taken.extend(taken);
        self.forget_counts();
        self.done = done;
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

/// How often a number can be halved.
fn halvings(number: usize) -> u32 {
    number.trailing_zeros()
}

/// Whether a snapshot with this number is taken whatever corrections there are.
fn is_lasting(number: usize) -> bool {
    halvings(number) >= HALVINGS_OF_LASTING
}

/// Whether a snapshot with this number is kept until so many intervals have passed. The beginning always is.
fn is_kept(number: usize, intervals: usize) -> bool {
    number == 0 || intervals.saturating_sub(number) < LIFE << halvings(number)
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
            let (mut snapshots, mut events) = (Snapshots::new(), Pages::default());
            for _ in 0..200 {
                for event in std::iter::once(key_frame()).chain((0..scans).map(|_| scan())) {
                    events.push(event);
                    let ten = events.len().saturating_sub(10 * (scans + 1));
                    snapshots.note_correction(Steps::after(&events, ten).count(events.iter_from(ten)));
                    snapshots.take_when_due(&map, &events);
                }
            }
            assert!(snapshots.taken.len() <= 8, "{} for {scans} scans", snapshots.taken.len());
            let first = events.len() - 10 * (scans + 1);
            snapshots.take_out_behind(first);
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

    /// Checks that a correction of so many steps begins at most `beside`, or as many as it moves, before them.
    fn check_distances(snapshots: &Snapshots, key_frames: usize, beside: usize) {
        let lengths = || snapshots.taken.iter().map(|snapshot| snapshot.events.len());
        for changed in 1..=key_frames {
            let first = key_frames - changed;
            let start = lengths().filter(|&length| length <= first).max().unwrap_or(0);
            assert!(first - start <= changed.max(beside), "{key_frames}: {changed} from {start}");
        }
    }

    #[test]
    fn the_younger_the_closer() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::new(), Pages::default());
        for key_frames in 1..=1500 {
            snapshots.note_correction(10);
            events.push(key_frame());
            snapshots.take_when_due(&map, &events);
            assert!(snapshots.taken.len() <= 15, "{}", snapshots.taken.len());
            check_distances(&snapshots, key_frames, INTERVAL);
        }
    }

    #[test]
    fn a_loop_closure_replays_twice_its_steps_whether_or_not_others_came_before() {
        let lasting = INTERVAL << HALVINGS_OF_LASTING;
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::new(), Pages::default());
        for key_frames in 1..=6000 {
            events.push(key_frame());
            snapshots.take_when_due(&map, &events);
            if key_frames % 97 == 0 {
                check_distances(&snapshots, key_frames, lasting);
                assert!(snapshots.taken.len() <= 12, "{}", snapshots.taken.len());
            }
            // A replay of the last thousand in batches, as it was and cut short, leaves what the next one needs.
            if key_frames % 1500 == 0 {
                let all = events.clone();
                let taken_out = snapshots.take_out_behind(key_frames - 1000);
                events = snapshots.newest().map_or_else(Pages::default, |snapshot| snapshot.events.clone());
                let last = if key_frames == 3000 { key_frames - 300 } else { key_frames };
                while events.len() < last {
                    let batch = (last - events.len()).min(8);
                    all.iter_from(events.len()).take(batch).for_each(|event| events.push(event.clone()));
                    snapshots.take_in_replay_when_due(batch, key_frames - events.len(), &map, &events);
                }
                if last < key_frames {
                    snapshots.put_back(taken_out);
                    events = all;
                }
                assert_eq!(snapshots.done, key_frames);
                // A batch of eight may end seven steps behind the number of its snapshot.
                check_distances(&snapshots, key_frames, lasting + 7);
            }
        }
    }

    #[test]
    fn a_replay_of_any_length_leaves_those_that_the_next_correction_needs() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::new(), Pages::default());
        snapshots.note_correction(10);
        let all = 3 * PATIENCE;
        for following in (0..all).rev() {
            events.push(key_frame());
            snapshots.take_in_replay_when_due(1, following, &map, &events);
            let is_left_at_the_end = |it: &Snapshot| is_kept(it.number, all / INTERVAL);
            assert!(snapshots.taken.iter().all(is_left_at_the_end));
        }
        check_distances(&snapshots, all, INTERVAL);
        snapshots.take_out_behind(all - 10);
        assert!(snapshots.newest().is_some_and(|snapshot| snapshot.events.len() >= all - 20));
    }

    #[test]
    fn a_replay_for_its_result_alone_takes_none() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::default(), Pages::default());
        for following in (0..PATIENCE).rev() {
            events.push(key_frame());
            snapshots.take_in_replay_when_due(1, following, &map, &events);
        }
        assert!(snapshots.taken.is_empty());
    }

    #[test]
    fn only_lasting_ones_are_taken_for_who_corrects_no_last_steps() {
        let map = MultiLevelMap::new(&Arc::default()).unwrap();
        let (mut snapshots, mut events) = (Snapshots::new(), Pages::default());
        events.push(key_frame());
        let insert = |snapshots: &mut Snapshots, key_frames: usize| {
            for _ in 0..key_frames {
                snapshots.take_when_due(&map, &events);
            }
            snapshots.taken.iter().filter(|snapshot| !is_lasting(snapshot.number)).count()
        };
        assert_eq!(insert(&mut snapshots, 100), 0);
        snapshots.note_correction(100);
        assert_eq!(insert(&mut snapshots, 100), 0);
        snapshots.note_correction(10);
        assert!(insert(&mut snapshots, 100) > 3);
        assert_eq!(insert(&mut snapshots, PATIENCE), 0);
    }
}

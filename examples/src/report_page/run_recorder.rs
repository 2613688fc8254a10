use std::collections::{BTreeMap, BTreeSet};

use dymlm::core::{ObjectId, PinholeCamera, Pose};
use dymlm::dynamics::BoxSource;
use dymlm::objects::ObjectState;
use dymlm::{FrameReport, MapBuilder, MapMemory, MapUpdate, MultiLevelMap};

use super::things::{PageObject, millimetres, page_object};

/// Approximate number of memory samples in a run.
const SAMPLES: usize = 200;
/// Most positions of a mover's path: more would not be seen on the page.
const MOST_POSITIONS: usize = 1000;

/// Records what the final maps do not contain any more: the memory over time, objects that were in the maps
/// and are gone, and the paths of movers.
#[derive(Debug)]
pub struct RunRecorder {
    frames_a_sample: usize,
    frames: usize,
    start: Option<f64>,
    clock_offset: Option<f64>,
    memory: Vec<(f64, MapMemory)>,
    /// All objects that were ever confirmed, in their last state.
    known: BTreeMap<ObjectId, PageObject>,
    /// Whether those of resumed maps are among them.
    knows_all: bool,
    gone: BTreeSet<ObjectId>,
    movers: BTreeMap<u64, MoverWay>,
    /// The maps before this run, if it resumed any.
    before: Option<MultiLevelMap>,
}

/// The path of a mover: the middle of its box at the depth of its foreground.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct MoverWay {
    track: u64,
    label: Option<String>,
    /// World, metres: of each so many frames that saw it.
    positions: Vec<[f64; 3]>,
    #[serde(skip)]
    frames_a_position: usize,
    #[serde(skip)]
    frames: usize,
}

impl MoverWay {
    /// Adds where a frame has seen it. When there are too many positions, each second one stays.
    fn add(&mut self, place: [f64; 3]) {
        if self.frames.is_multiple_of(self.frames_a_position) {
            self.positions.push(place);
        }
        self.frames += 1;
        if self.positions.len() > MOST_POSITIONS {
            let mut is_kept = [true, false].into_iter().cycle();
            self.positions.retain(|_| is_kept.next() == Some(true));
            self.frames_a_position *= 2;
        }
    }
}

impl RunRecorder {
    /// Starts recording, before the first of about this many frames.
    pub fn start(builder: &MapBuilder, frames: usize) -> Self {
        // For resumed maps, the changes since the resumption are what this run has found.
        let is_resumed = builder.map().cloud().frames() > 0;
        Self {
            frames_a_sample: (frames / SAMPLES).max(1),
            frames: 0,
            start: None,
            clock_offset: (!is_resumed).then_some(0.0),
            memory: Vec::new(),
            known: BTreeMap::new(),
            knows_all: false,
            gone: BTreeSet::new(),
            movers: BTreeMap::new(),
            before: is_resumed.then(|| builder.map().clone()),
        }
    }

    /// Records a frame that has just been inserted.
    pub fn record(
        &mut self,
        report: &FrameReport,
        camera: &PinholeCamera,
        world_from_camera: &Pose,
        builder: &MapBuilder,
    ) {
        let start = *self.start.get_or_insert(report.timestamp);
        if self.frames.is_multiple_of(self.frames_a_sample) {
            self.memory.push((report.timestamp - start, builder.memory()));
        }
        self.frames += 1;
        self.follow_movers(report, camera, world_from_camera);
        if let Some(update) = report.update() {
            self.learn_clock(report.timestamp, update, builder.map());
            self.watch_objects(update, builder.map());
        }
    }

    /// The offset from the times of reports to the clock of the maps: 0 unless maps were resumed.
    pub(super) fn clock_offset(&self) -> f64 {
        self.clock_offset.unwrap_or(0.0)
    }

    pub(super) fn memory(&self) -> &[(f64, MapMemory)] {
        &self.memory
    }

    /// Objects that were in the maps and are gone, by ascending ids.
    pub(super) fn gone(&self) -> impl Iterator<Item = &PageObject> {
        self.gone.iter().filter_map(|id| self.known.get(id))
    }

    /// Paths of at least two positions, by ascending track ids.
    pub(super) fn mover_ways(&self) -> Vec<&MoverWay> {
        self.movers.values().filter(|way| way.positions.len() > 1).collect()
    }

    /// The maps before this run, if it resumed any.
    pub(super) fn before(&self) -> Option<&MultiLevelMap> {
        self.before.as_ref()
    }

    /// Learns the clock's offset: a plane seen in this frame has the frame's time as its last one.
    fn learn_clock(&mut self, timestamp: f64, update: &MapUpdate, map: &MultiLevelMap) {
        if self.clock_offset.is_none() {
            let seen = update.planes.updated.first().or(update.planes.created.first());
            let seen = seen.and_then(|&id| map.planes().plane(id));
            self.clock_offset = seen.map(|plane| plane.last_seen() - timestamp);
        }
    }

    /// Keeps the last state of each object: those that were there before are looked at once, then those
    /// that a frame has changed.
    fn watch_objects(&mut self, update: &MapUpdate, map: &MultiLevelMap) {
        let (changes, objects) = (&update.objects, map.objects());
        self.gone.extend(changes.removed.iter().filter(|id| self.known.contains_key(id)));
        let seen = changes.observed.iter().map(|(_, id)| *id);
        let kept = changes.merged.iter().map(|merge| merge.kept);
        let changed = seen.chain(kept).chain(changes.confirmed.iter().copied());
        let all = (!std::mem::replace(&mut self.knows_all, true)).then(|| objects.objects());
        for object in all.into_iter().flatten().chain(changed.filter_map(|id| objects.object(id))) {
            if object.state() == ObjectState::Confirmed {
                self.known.insert(object.id(), page_object(object, Vec::new()));
            }
        }
    }

    fn follow_movers(&mut self, report: &FrameReport, camera: &PinholeCamera, world_from_camera: &Pose) {
        for mover in report.movers.iter().filter(|mover| matches!(mover.source, BoxSource::Detected { .. })) {
            let Some(depth) = mover.depth else { continue };
            let center = mover.corrected_box.center().map(f64::from);
            let place = world_from_camera.transform_point(camera.back_project(center, f64::from(depth)));
            let track = mover.track_id.get();
            let way = self.movers.entry(track).or_insert_with(|| MoverWay {
                track,
                label: mover.label.as_deref().map(str::to_owned),
                positions: Vec::new(),
                frames_a_position: 1,
                frames: 0,
            });
            way.add(millimetres(place));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_path_is_spread_over_all_of_it() {
        let mut way =
            MoverWay { track: 0, label: None, positions: Vec::new(), frames_a_position: 1, frames: 0 };
        for frame in 0..10_000 {
            way.add([f64::from(frame), 0.0, 0.0]);
        }
        assert!((MOST_POSITIONS / 2..=MOST_POSITIONS).contains(&way.positions.len()));
        assert!(way.positions.windows(2).all(|pair| (pair[1][0] - pair[0][0] - 16.0).abs() < 1e-9));
        assert!(way.positions[0][0] < 1.0 && way.positions.last().is_some_and(|last| last[0] > 9980.0));
    }
}

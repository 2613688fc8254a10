use dymlm::files::MapSaver;
use dymlm::{Detections, Error, MapBuilder, MapConfig, MapReader, MultiLevelMap};
use dymlm_core::{FrameId, Point, Pose};
use tempfile::TempDir;

use crate::any_frame::{detections, frame};
use crate::choices::Choices;
use crate::fingerprint::fingerprint;
use crate::memory_folder::memory_folder;

/// A map builder whose methods are called in any order and with any arguments. Refused calls must change
/// nothing; saved maps must load as the same.
pub(crate) struct Calls {
    pub(crate) builder: MapBuilder,
    reader: MapReader,
    time: f64,
    saver: Option<(TempDir, MapSaver)>,
    /// The maps at an earlier time.
    kept: Option<MultiLevelMap>,
}

impl Calls {
    pub(crate) fn new(config: MapConfig, time: f64) -> Self {
        let mut builder = MapBuilder::new(config).unwrap();
        let reader = builder.reader();
        Self { builder, reader, time, saver: None, kept: None }
    }

    /// Makes at most `count` calls, until the choices end.
    pub(crate) fn run(&mut self, count: usize, choices: &mut Choices<'_>) {
        for _ in 0..count {
            if choices.is_over() {
                break;
            }
            self.call(choices);
            let latest = self.reader.latest();
            // Counting goes through all maps; after each call it would take most of the time.
            if choices.byte() < 16 {
                let _ = (latest.counts(), self.builder.trajectory().count());
            }
        }
    }

    fn call(&mut self, choices: &mut Choices<'_>) {
        // The clone shares unchanged memory, and is compared only if the call is refused.
        let before = (self.builder.map().clone(), self.builder.trajectory().count());
        let is_refused = match choices.below(16) {
            0..=5 => self.insert(choices).is_err(),
            6 => {
                let id = self.frame_id(choices);
                self.builder.detections_for(id, &detections(choices)).is_err()
            }
            7 | 8 => {
                let frames = self.builder.trajectory().count() as u64;
                let poses: Vec<(FrameId, Pose)> = (0..=choices.below(3))
                    .map(|_| (FrameId::new(u64::from(choices.byte()) % (frames + 1)), choices.pose()))
                    .collect();
                self.builder.correct_poses(&poses).is_err()
            }
            9 => {
                let id = self.frame_id(choices);
                self.builder.remove(id).is_err()
            }
            10 => self.builder.transform(&choices.pose()).is_err(),
            11 => {
                self.builder.forget_outside(choices.numbers(), choices.number());
                false
            }
            12 => {
                self.time += 0.1;
                let points: Vec<Point> =
                    (0..choices.below(20)).map(|_| choices.numbers().map(|c: f64| c as f32)).collect();
                self.builder.insert_scan(self.time, &points, &choices.pose()).is_err()
            }
            13 => self.begin_anew(choices),
            14 => self.save_and_load(choices),
            _ => self.merge(choices),
        };
        if is_refused {
            let now = (self.builder.map().counts(), self.builder.trajectory().count());
            assert_eq!(now, (before.0.counts(), before.1), "what was refused has changed the maps");
        }
    }

    fn insert(&mut self, choices: &mut Choices<'_>) -> Result<(), Error> {
        self.time += if choices.byte() < 250 { 0.2 } else { choices.number() };
        let Some(frame) = frame(choices, self.time) else { return Ok(()) };
        let found = detections(choices);
        let found = match choices.below(8) {
            0 => Detections::NotRun,
            1 | 2 => Detections::Pending,
            _ => Detections::Found(&found),
        };
        self.builder.insert(&frame, found, &choices.pose()).map(drop)
    }

    /// Mostly the id of an inserted frame.
    fn frame_id(&self, choices: &mut Choices<'_>) -> FrameId {
        let frames = self.builder.trajectory().count() as u64;
        let is_known = frames > 0 && choices.byte() < 240;
        FrameId::new(if is_known { u64::from(choices.byte()) % frames } else { 1 << 60 })
    }

    fn begin_anew(&mut self, choices: &mut Choices<'_>) -> bool {
        match choices.below(4) {
            0 => self.builder.settle(),
            1 => drop(self.builder.begin_session().unwrap()),
            2 => self.kept = Some(self.builder.map().clone()),
            _ => {
                self.resume(self.builder.map().clone());
                self.time = choices.number();
            }
        }
        false
    }

    fn resume(&mut self, map: MultiLevelMap) {
        self.builder = MapBuilder::resume(map).unwrap();
        self.reader = self.builder.reader();
    }

    /// Saves, loads and continues with the loaded maps, which must follow corrections like maps that were
    /// never saved.
    fn save_and_load(&mut self, choices: &mut Choices<'_>) -> bool {
        let (_, saver) = self.saver.get_or_insert_with(|| {
            let folder = memory_folder();
            let saver = MapSaver::create(folder.path().join("map")).unwrap();
            (folder, saver)
        });
        saver.save(self.builder.map()).unwrap();
        let loaded = MultiLevelMap::load(saver.folder()).unwrap();
        assert!(fingerprint(&loaded) == fingerprint(self.builder.map()), "loaded is not what was saved");
        let mut never_saved = MapBuilder::resume(self.builder.map().clone()).unwrap();
        self.resume(loaded);
        assert!(self.builder.trajectory().eq(never_saved.trajectory()));
        if choices.is_true() {
            let moved = choices.pose();
            let corrected = [self.builder.transform(&moved), never_saved.transform(&moved)];
            assert_eq!(corrected[0].is_ok(), corrected[1].is_ok());
            let [loaded, expected] = [self.builder.map(), never_saved.map()].map(fingerprint);
            assert!(loaded == expected, "what was loaded follows a correction elsewhere");
        }
        false
    }

    fn merge(&mut self, choices: &mut Choices<'_>) -> bool {
        let Some(other) = &self.kept else {
            self.kept = Some(self.builder.map().clone());
            return false;
        };
        let world_from_other = if choices.is_true() { Pose::identity() } else { choices.pose() };
        let mut map = self.builder.map().clone();
        if let Ok(report) = map.merge(other, &world_from_other) {
            assert_eq!(report.sessions.len(), map.sessions().len());
            self.resume(map);
            return false;
        }
        assert_eq!(map.counts(), self.builder.map().counts(), "a refused merge has changed the maps");
        true
    }
}

//! Whatever happens in a session, and whichever poses are corrected in whatever order: the maps are those of
//! their frames at their poses.

use std::sync::LazyLock;

use dymlm_core::{FrameId, ObjectId, PinholeCamera, Point, Pose};
use dymlm_history::HistoryConfig;
use dymlm_octree::RayMode;
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};
use proptest::prelude::*;

#[cfg(feature = "io")]
use crate::common::fingerprint;
use crate::common::map_copy::MapCopy;
use crate::common::{fingerprint_without_ids, ids, poses};
#[cfg(feature = "io")]
use crate::files::MapSaver;
use crate::session_log::BodyMotion;
use crate::{Detections, MapBuilder, MapConfig, MultiLevelMap};

/// Frames of the longest session.
const FRAMES: usize = 14;

/// A walk in small images: people, furniture, planes, objects.
static WALK: LazyLock<Vec<SimulatedFrame>> = LazyLock::new(|| {
    let mut config = SequenceConfig::default();
    config.frames = 5 * FRAMES;
    config.camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).ok();
    Sequence::new(&config).unwrap().frames().step_by(5).collect()
});

/// Something that happens in a session.
#[derive(Debug, Clone)]
enum Step {
    Frame { is_detector_run: bool },
    Scan,
    Settle,
    Forget { radius: f64 },
    Hold { which: usize, is_held: bool },
    PutDown { which: usize, by: f64 },
    Correct(Correction),
    Remove { which: usize },
    BeginSession,
}

/// Some frames are found to be elsewhere.
#[derive(Debug, Clone)]
struct Correction {
    chosen: Vec<usize>,
    metres: f64,
    radians: f64,
}

/// Cells are large, so that hundreds of sessions take minutes.
fn builder() -> MapBuilder {
    let mut config = MapConfig { history: HistoryConfig::Memory, ..MapConfig::default() };
    config.cloud.voxel_size = 0.05;
    config.octree.resolution = 0.2;
    config.octree.rays = RayMode::PerCell;
    MapBuilder::new(config).unwrap()
}

fn correction() -> impl Strategy<Value = Correction> {
    (prop::collection::vec(0..FRAMES, 1..5), -0.3_f64..0.3, -0.1_f64..0.1)
        .prop_map(|(chosen, metres, radians)| Correction { chosen, metres, radians })
}

fn step() -> impl Strategy<Value = Step> {
    let which = 0..20_usize;
    prop_oneof![
        10 => any::<bool>().prop_map(|is_detector_run| Step::Frame { is_detector_run }),
        2 => Just(Step::Scan),
        1 => Just(Step::Settle),
        1 => (1.0..4.0).prop_map(|radius| Step::Forget { radius }),
        1 => (which.clone(), any::<bool>()).prop_map(|(which, is_held)| Step::Hold { which, is_held }),
        1 => (which.clone(), 0.1..1.0).prop_map(|(which, by)| Step::PutDown { which, by }),
        2 => correction().prop_map(Step::Correct),
        1 => which.prop_map(|which| Step::Remove { which }),
        1 => Just(Step::BeginSession),
    ]
}

fn session() -> impl Strategy<Value = Vec<Step>> {
    prop::collection::vec(step(), 4..24)
}

/// So many cases, or as many as `PROPTEST_CASES` says (`.ci/nightly`: hundreds).
fn cases(count: u32) -> ProptestConfig {
    let told = std::env::var_os("PROPTEST_CASES").is_some();
    let config = if told { ProptestConfig::default() } else { ProptestConfig::with_cases(count) };
    // A case takes half a second.
    ProptestConfig { max_shrink_iters: 100, ..config }
}

/// A session under way, with somebody who is told its changes alone.
struct Session {
    builder: MapBuilder,
    next: usize,
    /// When the clock of the current session began, on that of the walk.
    clock_start: f64,
    known: MultiLevelMap,
    copy: MapCopy,
    /// Saves the maps after each step, if there is one: then a further session begins with those of the file.
    #[cfg(feature = "io")]
    saver: Option<MapSaver>,
}

impl Session {
    fn new() -> Self {
        let builder = builder();
        Self {
            next: 0,
            clock_start: 0.0,
            known: builder.map().clone(),
            copy: MapCopy::default(),
            #[cfg(feature = "io")]
            saver: None,
            builder,
        }
    }

    fn run(steps: &[Step]) -> Self {
        let mut session = Self::new();
        for step in steps {
            session.take(step);
            session.check_copy();
        }
        session
    }

    /// The same with maps that are saved after each step, and loaded for each further session.
    #[cfg(feature = "io")]
    fn run_saved(steps: &[Step], folder: &std::path::Path) -> Self {
        let mut session = Self::new();
        session.saver = Some(MapSaver::create(folder).unwrap());
        for step in steps {
            session.take(step);
            if let Some(saver) = &mut session.saver {
                saver.save(session.builder.map()).unwrap();
            }
            session.check_copy();
        }
        session
    }

    #[cfg(feature = "io")]
    fn load_saved(&mut self) {
        if let Some(saver) = &mut self.saver {
            saver.save(self.builder.map()).unwrap();
            let map = MultiLevelMap::load(saver.folder()).unwrap();
            self.builder = MapBuilder::resume(map).unwrap();
        }
    }

    fn take(&mut self, step: &Step) {
        match *step {
            Step::Frame { is_detector_run } => {
                if let Some(simulated) = self.next_frame() {
                    let SimulatedFrame { frame, detections, world_from_camera, .. } = simulated;
                    let found =
                        if is_detector_run { Detections::Found(detections) } else { Detections::NotRun };
                    let mut frame = frame.clone();
                    frame.set_timestamp(self.time(simulated)).unwrap();
                    let report = self.builder.insert(&frame, found, world_from_camera).unwrap();
                    assert_eq!(report.timestamp, frame.timestamp());
                }
            }
            Step::Scan => {
                if let Some(frame) = self.next_frame() {
                    let (time, pose) = (self.time(frame), &frame.world_from_camera);
                    self.builder.insert_scan(time, &points(frame), pose).unwrap();
                }
            }
            Step::Settle => self.builder.settle(),
            Step::Forget { radius } => {
                let newest = self.builder.trajectory().last().map(|(_, _, pose)| pose.translation());
                self.builder.forget_outside(newest.unwrap_or_default(), radius);
            }
            Step::Hold { which, is_held } => {
                if let Some(object) = self.object(which) {
                    self.builder.set_held(object, is_held);
                }
            }
            Step::PutDown { which, by } => {
                if let Some(object) = self.object(which) {
                    let new_from_old = Pose::new([by, -0.5 * by, 0.0], [0.0, 0.0, 0.6, 0.8]).unwrap();
                    self.builder.put_down(object, BodyMotion { new_from_old, tracked: None }).unwrap();
                }
            }
            Step::Correct(ref correction) => self.correct(correction),
            Step::Remove { which } => {
                let frames = self.builder.trajectory().count();
                if frames > 0 {
                    self.builder.remove(FrameId::new((which % frames) as u64)).unwrap();
                }
            }
            Step::BeginSession => {
                #[cfg(feature = "io")]
                self.load_saved();
                self.builder.begin_session().unwrap();
                self.clock_start = WALK.get(self.next).map_or(0.0, |frame| frame.frame.timestamp());
            }
        }
    }

    /// Frames come in the order of their time, each once.
    fn next_frame(&mut self) -> Option<&'static SimulatedFrame> {
        self.next += 1;
        WALK.get(self.next - 1)
    }

    /// When a frame was taken, on the clock of the current session.
    fn time(&self, frame: &SimulatedFrame) -> f64 {
        frame.frame.timestamp() - self.clock_start
    }

    /// One of those in the map, believed or not.
    fn object(&self, which: usize) -> Option<ObjectId> {
        let (_, objects) = ids(self.builder.map());
        objects.get(which % objects.len().max(1)).copied()
    }

    fn correct(&mut self, correction: &Correction) {
        let step = moved(correction.metres, correction.radians);
        let mut given = poses(&self.builder);
        given.retain(|(id, _)| correction.chosen.contains(&(id.get() as usize)));
        for (_, pose) in &mut given {
            *pose = step * *pose;
        }
        self.builder.correct_poses(&given).unwrap();
        let now = poses(&self.builder);
        assert!(given.iter().all(|given| now.contains(given)));
    }

    fn check_copy(&mut self) {
        self.copy.follow(&self.known, self.builder.map());
        assert_eq!(self.copy.difference(self.builder.map()), None);
        self.known = self.builder.map().clone();
    }
}

/// What a frame's pixels read, as another sensor would give it.
fn points(frame: &SimulatedFrame) -> Vec<Point> {
    let (camera, depth) = (frame.frame.camera(), frame.frame.depth());
    let pixels = (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v)));
    let read = pixels.filter(|&(u, v)| depth.at(u, v) > 0.0);
    read.map(|(u, v)| camera.back_project([u as f64, v as f64], depth.at(u, v).into()).map(|c| c as f32))
        .collect()
}

fn moved(metres: f64, radians: f64) -> Pose {
    let half = 0.5 * radians;
    Pose::new([metres, 0.3 * metres, 0.0], [0.0, 0.0, half.sin(), half.cos()]).unwrap()
}

/// The maps after a session are corrected and corrected back.
fn check_corrected_back(steps: &[Step], corrections: &[Correction]) {
    let mut session = Session::run(steps);
    let right = poses(&session.builder);
    let first = fingerprint_without_ids(session.builder.map());
    let (planes, objects) = ids(session.builder.map());
    for correction in corrections {
        session.correct(correction);
        session.check_copy();
    }
    // All are built from the beginning.
    session.builder.transform(&moved(7.0, 0.5)).unwrap();
    session.builder.correct_poses(&right).unwrap();
    session.check_copy();
    assert_eq!(poses(&session.builder), right);
    assert!(fingerprint_without_ids(session.builder.map()) == first);
    // Each id leads to something still: what was one with another on the way keeps the other's.
    let map = session.builder.map();
    assert!(planes.into_iter().all(|id| map.planes().current_id(id).is_some()));
    assert!(objects.into_iter().all(|id| map.objects().object(id).is_some()));
}

/// The maps after all frames of a session are taken out, in an order.
fn check_nothing_left(steps: &[Step], order: impl IntoIterator<Item = u64>) {
    let mut session = Session::run(steps);
    let frames = poses(&session.builder).len() as u64;
    for id in order.into_iter().filter(|&id| id < frames) {
        session.builder.remove(FrameId::new(id)).unwrap();
        session.check_copy();
    }
    let counts = session.builder.map().counts();
    assert_eq!((counts.cloud_voxels, counts.octree_leaves, counts.planes, counts.objects), (0, 0, 0, 0));
    assert_eq!(ids(session.builder.map()), (Vec::new(), Vec::new()));
}

proptest! {
    #![proptest_config(cases(8))]

    /// Also what was forgotten, carried and put down on the way.
    #[test]
    fn corrected_back_the_maps_are_the_first_to_the_bit(
        steps in session(),
        corrections in prop::collection::vec(correction(), 1..3),
    ) {
        check_corrected_back(&steps, &corrections);
    }

    /// Of the same frames with corrections afterwards, in whatever order and however many at a time.
    #[test]
    fn only_the_last_poses_count(
        steps in session(),
        corrections in prop::collection::vec(correction(), 2..5),
    ) {
        let is_uncorrected =
            |step: &&Step| !matches!(step, Step::Correct(_) | Step::Remove { .. } | Step::PutDown { .. });
        let steps: Vec<Step> = steps.iter().filter(is_uncorrected).cloned().collect();
        let mut session = Session::run(&steps);
        for correction in &corrections {
            session.correct(correction);
        }
        let mut again = Session::run(&steps);
        again.builder.correct_poses(&poses(&session.builder)).unwrap();
        prop_assert!(
            fingerprint_without_ids(again.builder.map()) == fingerprint_without_ids(session.builder.map())
        );
    }

    #[test]
    fn without_its_frames_a_session_leaves_nothing(
        steps in session(),
        order in Just((0..FRAMES as u64).collect::<Vec<_>>()).prop_shuffle(),
    ) {
        check_nothing_left(&steps, order);
    }
}

#[cfg(feature = "io")]
proptest! {
    #![proptest_config(cases(8))]

    #[test]
    fn maps_that_were_saved_and_loaded_go_on_to_the_same_bits(
        steps in session(),
        cut in 0..20_usize,
        last in correction(),
    ) {
        let mut steps = steps;
        steps.insert(cut % steps.len(), Step::BeginSession);
        let folder = tempfile::tempdir().unwrap();
        let mut direct = Session::run(&steps);
        let mut loaded = Session::run_saved(&steps, &folder.path().join("map"));
        for _ in 0..2 {
            prop_assert!(fingerprint(loaded.builder.map()) == fingerprint(direct.builder.map()));
            prop_assert_eq!(poses(&loaded.builder), poses(&direct.builder));
            direct.correct(&last);
            loaded.correct(&last);
        }
    }
}

#[test]
fn there_is_something_in_the_sessions() {
    let steps: Vec<Step> = (0..FRAMES).map(|_| Step::Frame { is_detector_run: true }).collect();
    let session = Session::run(&steps);
    let counts = session.builder.map().counts();
    assert!(counts.cloud_voxels > 1000 && counts.octree_leaves > 300, "{counts:?}");
    assert!(counts.planes >= 3 && counts.objects >= 3, "{counts:?}");
}

fn frames(detected: &[bool]) -> Vec<Step> {
    detected.iter().map(|&is_detector_run| Step::Frame { is_detector_run }).collect()
}

/// What one map had merged, the next had the other way round, and both things went: their ids led to each
/// other, and looking one up never ended.
#[test]
fn merged_ids_of_two_maps_do_not_lead_round_in_a_circle() {
    let mut steps = frames(&[false, true, false, false, true, false, false, true]);
    steps.push(Step::Forget { radius: 1.0 });
    check_nothing_left(&steps, 0..8);
}

#[test]
fn what_vanished_after_it_was_put_down_is_put_down_again() {
    let mut steps = vec![Step::Frame { is_detector_run: true }; 3];
    steps.push(Step::PutDown { which: 0, by: 0.1 });
    steps.extend(vec![Step::Frame { is_detector_run: false }; 8]);
    check_corrected_back(&steps, &[]);
}

#[test]
fn the_same_object_is_put_down_again_after_it_was_one_with_another() {
    let away =
        |chosen: usize, metres: f64, radians: f64| Correction { chosen: vec![chosen], metres, radians };
    let mut steps = frames(&[false, true, false]);
    steps.push(Step::Correct(away(0, -0.145_098_309_393_193_65, 0.067_525_432_119_628_91)));
    steps.extend(frames(&[false; 3]));
    steps.push(Step::PutDown { which: 5, by: 0.605_813_115_440_317_5 });
    steps.extend(frames(&[false, false, true]));
    check_corrected_back(&steps, &[away(2, 0.118_289_911_335_110_98, 0.0)]);
}

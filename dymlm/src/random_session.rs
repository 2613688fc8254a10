//! Random sessions for tests, in which anything happens.

use std::collections::VecDeque;
use std::sync::LazyLock;

use dymlm_core::{FrameId, ObjectId, PinholeCamera, Point, Pose};
use dymlm_history::HistoryConfig;
use dymlm_objects::SightedPoint;
use dymlm_octree::RayMode;
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};
use dymlm_test_support::cases;
use proptest::prelude::*;

#[cfg(feature = "io")]
use crate::common::fingerprint;
use crate::common::map_copy::MapCopy;
use crate::common::{ids, poses};
#[cfg(feature = "io")]
use crate::files::MapSaver;
use crate::session_log::BodyMotion;
use crate::{Detections, Error, FrameInput, MapBuilder, MapConfig, MultiLevelMap};

/// Frames of the longest session.
pub(crate) const FRAMES: usize = 14;

/// A walk in small images: people, furniture, planes, objects.
pub(crate) static WALK: LazyLock<Vec<SimulatedFrame>> = LazyLock::new(|| {
    let mut config = SequenceConfig::default();
    config.frames = 5 * FRAMES;
    config.camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).ok();
    Sequence::new(&config).unwrap().frames().step_by(5).collect()
});

/// Something that happens in a session.
#[derive(Debug, Clone)]
pub(crate) enum Step {
    Frame {
        is_detector_run: bool,
    },
    /// A frame whose detector still runs.
    AwaitingFrame,
    /// The detections of the frame that has awaited them for longest.
    Detections,
    Scan,
    Settle,
    Forget {
        radius: f64,
    },
    Hold {
        which: usize,
        is_held: bool,
    },
    PutDown {
        which: usize,
        by: f64,
    },
    Correct(Correction),
    Remove {
        which: usize,
    },
    BeginSession,
}

/// A correction that moves some frames.
#[derive(Debug, Clone)]
pub(crate) struct Correction {
    pub(crate) chosen: Vec<usize>,
    pub(crate) metres: f64,
    pub(crate) radians: f64,
}

/// Cells are large, so that hundreds of sessions take only minutes.
pub(crate) fn builder() -> MapBuilder {
    let mut config = MapConfig { history: HistoryConfig::Memory, ..MapConfig::default() };
    config.cloud.voxel_size = 0.05;
    config.octree.resolution = 0.2;
    config.octree.rays = RayMode::PerCell;
    MapBuilder::new(config).unwrap()
}

pub(crate) fn correction() -> impl Strategy<Value = Correction> {
    (prop::collection::vec(0..FRAMES, 1..5), -0.3_f64..0.3, -0.1_f64..0.1)
        .prop_map(|(chosen, metres, radians)| Correction { chosen, metres, radians })
}

fn step() -> impl Strategy<Value = Step> {
    let which = 0..20_usize;
    prop_oneof![
        10 => any::<bool>().prop_map(|is_detector_run| Step::Frame { is_detector_run }),
        2 => Just(Step::AwaitingFrame),
        2 => Just(Step::Detections),
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

pub(crate) fn session() -> impl Strategy<Value = Vec<Step>> {
    prop::collection::vec(step(), 4..24)
}

/// `count` cases, or [times as many](cases).
pub(crate) fn few(count: u32) -> ProptestConfig {
    // A case takes half a second, so few are spent on shrinking.
    ProptestConfig { max_shrink_iters: 100, ..ProptestConfig::with_cases(cases(count)) }
}

/// A session under way, with a copy of its maps that follows by their changes alone.
pub(crate) struct Session {
    pub(crate) builder: MapBuilder,
    next: usize,
    /// When the clock of the current session began, on the clock of the walk.
    clock_start: f64,
    /// What the clock shows when a further session begins.
    further: f64,
    known: MultiLevelMap,
    copy: MapCopy,
    /// Frames whose detections have not come, the oldest first.
    awaiting: VecDeque<(FrameId, &'static SimulatedFrame)>,
    /// Saves the maps after each step, if there is one: then a further session begins with the maps of the
    /// file.
    #[cfg(feature = "io")]
    saver: Option<MapSaver>,
}

/// Map points of a SLAM: other sessions have the same ids, and a thing may have another one in another frame.
fn sighted(simulated: &SimulatedFrame) -> Vec<SightedPoint> {
    let boxes = simulated.detections.iter().map(|found| found.bounding_box().center());
    boxes.zip(0..).map(|(center, id)| SightedPoint::new(id, center)).collect()
}

impl Session {
    pub(crate) fn new() -> Self {
        Self::starting(0, 0.0)
    }

    /// A session that begins with frame `next` of the walk, when its clock shows `time`. The clock begins anew with
    /// each further session, at the fraction of a second in `time`: recordings of which that differs have no
    /// session in common.
    pub(crate) fn starting(next: usize, time: f64) -> Self {
        let builder = builder();
        let mut session = Self {
            next,
            clock_start: 0.0,
            further: time.fract(),
            known: builder.map().clone(),
            copy: MapCopy::default(),
            awaiting: VecDeque::new(),
            #[cfg(feature = "io")]
            saver: None,
            builder,
        };
        session.set_clock(time);
        session
    }

    /// Sets the session's clock so that the next frame comes at `time`.
    pub(crate) fn set_clock(&mut self, time: f64) {
        self.clock_start = WALK.get(self.next).map_or(0.0, |frame| frame.frame.timestamp()) - time;
    }

    pub(crate) fn run(steps: &[Step]) -> Self {
        let mut session = Self::new();
        for step in steps {
            session.take(step);
            session.check_copy();
        }
        session
    }

    /// Runs the steps, saves the maps after each, and loads them for each further session. After each step, what
    /// was saved is the maps: what they keep between steps (verdicts, points) is what is made from nothing.
    #[cfg(feature = "io")]
    pub(crate) fn run_saved(steps: &[Step], folder: &std::path::Path) -> Self {
        let mut session = Self::new();
        session.saver = Some(MapSaver::create(folder).unwrap());
        for step in steps {
            session.take(step);
            if let Some(saver) = &mut session.saver {
                saver.save(session.builder.map()).unwrap();
                let loaded = MultiLevelMap::load(saver.folder()).unwrap();
                assert!(fingerprint(&loaded) == fingerprint(session.builder.map()), "{step:?}");
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

    pub(crate) fn take(&mut self, step: &Step) {
        match *step {
            Step::Frame { is_detector_run } => {
                if let Some(frame) = self.next_frame() {
                    let found = Detections::Found(&frame.detections);
                    self.insert(frame, if is_detector_run { found } else { Detections::NotRun });
                }
            }
            Step::AwaitingFrame => {
                if let Some(frame) = self.next_frame() {
                    let id = self.insert(frame, Detections::Pending);
                    self.awaiting.push_back((id, frame));
                }
            }
            Step::Detections => {
                if let Some((id, frame)) = self.awaiting.pop_front() {
                    // Removed meanwhile, or given up and not mapped.
                    match self.builder.detections_for(id, &frame.detections) {
                        Ok(_) | Err(Error::NotPending { .. }) => (),
                        Err(error) => panic!("{error}"),
                    }
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
                self.builder.process_waiting().unwrap();
                #[cfg(feature = "io")]
                self.load_saved();
                self.builder.begin_session().unwrap();
                self.set_clock(self.further);
            }
        }
    }

    fn insert(&mut self, simulated: &SimulatedFrame, found: Detections<'_>) -> FrameId {
        let mut frame = simulated.frame.clone();
        frame.set_timestamp(self.time(simulated)).unwrap();
        let points = sighted(simulated);
        let input = FrameInput::new(&frame, found, &simulated.world_from_camera);
        let report = self.builder.insert_frame(&input.with_sighted_points(&points)).unwrap();
        assert_eq!(report.timestamp, frame.timestamp());
        report.id
    }

    /// The next frame of the walk: they come in the order of their time, each once.
    fn next_frame(&mut self) -> Option<&'static SimulatedFrame> {
        self.next += 1;
        WALK.get(self.next - 1)
    }

    /// When a frame was taken, on the clock of the current session.
    fn time(&self, frame: &SimulatedFrame) -> f64 {
        frame.frame.timestamp() - self.clock_start
    }

    /// One of the objects in the map, confirmed or not.
    fn object(&self, which: usize) -> Option<ObjectId> {
        let (_, objects) = ids(self.builder.map());
        objects.get(which % objects.len().max(1)).copied()
    }

    pub(crate) fn correct(&mut self, correction: &Correction) {
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

    pub(crate) fn check_copy(&mut self) {
        self.copy.follow(&self.known, self.builder.map());
        assert_eq!(self.copy.difference(self.builder.map()), None);
        self.known = self.builder.map().clone();
    }
}

/// What a frame's pixels have read, as the points of another sensor.
fn points(frame: &SimulatedFrame) -> Vec<Point> {
    let (camera, depth) = (frame.frame.camera(), frame.frame.depth());
    let pixels = (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v)));
    let read = pixels.filter(|&(u, v)| depth.at(u, v) > 0.0);
    read.map(|(u, v)| camera.back_project([u as f64, v as f64], depth.at(u, v).into()).map(|c| c as f32))
        .collect()
}

pub(crate) fn moved(metres: f64, radians: f64) -> Pose {
    let half = 0.5 * radians;
    Pose::new([metres, 0.3 * metres, 0.0], [0.0, 0.0, half.sin(), half.cos()]).unwrap()
}

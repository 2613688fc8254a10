use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use dymlm::core::{Mask, PointCloud};
use dymlm::{FrameReport, MapBuilder, Selection};
use dymlm_examples::{AnyError, Milliseconds, SequenceSet, progress_bar};
use dymlm_sim::{MaskScore, SimulatedFrame, Truth, TruthConfig, score_cloud};
use indicatif::ProgressBar;
use serde::Serialize;

use crate::columns::Scores;
use crate::residue_picture::Panel;
use crate::subjects::Subject;
use crate::treatment::Treatment;

/// One row of the table.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    /// Name of the sequence.
    pub(crate) sequence: String,
    /// The set it belongs to; none for means.
    #[serde(skip)]
    pub(crate) set: Option<SequenceSet>,
    /// What was done about movers.
    pub(crate) treatment: Treatment,
    /// Before or after late removal.
    pub(crate) stage: Stage,
    /// The figures.
    pub(crate) scores: Scores,
}

/// Late removal (ghosts by the evidence of all frames, noise by thinning) concerns the cloud; other maps are scored
/// with the finished cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Stage {
    /// The cloud with all that came in.
    Before,
    /// The finished cloud.
    After,
}

impl Stage {
    /// Name in tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::After => "after",
        }
    }

    fn selection(self) -> Selection {
        match self {
            Self::Before => Selection::All,
            Self::After => Selection::Static,
        }
    }
}

/// What comes of one sequence.
pub(crate) struct Evaluation {
    /// Its rows of the table.
    pub(crate) rows: Vec<Row>,
    /// The cloud of each row from above, residue marked; none when there is but one way of treating movers.
    pub(crate) panels: Vec<Panel>,
}

/// Maps every subject in every way, on all cores: a sequence a core. The rows come in the order of the subjects,
/// whichever is done first, and do not depend on the number of cores (but for the times).
pub(crate) fn evaluate(subjects: &[Subject], treatments: &[Treatment]) -> Result<Vec<Evaluation>, AnyError> {
    let frames = subjects.iter().map(|subject| subject.sequence.len()).sum();
    let bar = progress_bar(frames, "evaluating");
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<Result<Evaluation, AnyError>>>> =
        subjects.iter().map(|_| Mutex::new(None)).collect();
    let work = || {
        while let Some((subject, slot)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            subjects.get(index).zip(done.get(index))
        } {
            let evaluation = evaluate_subject(subject, treatments, &bar);
            if let Ok(mut slot) = slot.lock() {
                *slot = Some(evaluation);
            }
        }
    };
    let cores = thread::available_parallelism().map_or(1, usize::from).min(subjects.len());
    thread::scope(|scope| (0..cores).for_each(|_| drop(scope.spawn(work))));
    bar.finish_and_clear();
    let results = done.into_iter().map(|slot| slot.into_inner().ok().flatten());
    results.map(|result| result.unwrap_or_else(|| Err("a sequence was not evaluated".into()))).collect()
}

/// Renders each frame once and feeds it to one builder a treatment.
fn evaluate_subject(
    subject: &Subject,
    treatments: &[Treatment],
    bar: &ProgressBar,
) -> Result<Evaluation, AnyError> {
    let mut truth = Truth::new(&subject.sequence, &TruthConfig::default())?;
    let mut runs = treatments.iter().map(|&treatment| Run::new(treatment)).collect::<Result<Vec<_>, _>>()?;
    for frame in subject.sequence.frames() {
        truth.observe(&frame);
        runs.iter_mut().try_for_each(|run| run.insert(&frame))?;
        bar.inc(1);
    }

    let mut evaluation = Evaluation { rows: Vec::new(), panels: Vec::new() };
    let stages: &[Stage] =
        if treatments.len() > 1 { &[Stage::Before, Stage::After] } else { &[Stage::After] };
    for run in &runs {
        for &stage in stages {
            let cloud = run.builder.map().cloud().point_cloud(stage.selection());
            let mut scores = Scores::default();
            score_of_cloud(&mut scores, &cloud, &truth);
            if stage == Stage::After {
                run.score_all_but_the_cloud(&mut scores);
            }
            if treatments.len() > 1 {
                evaluation.panels.push(Panel::draw(&cloud, &truth, &subject.sequence));
            }
            evaluation.rows.push(Row {
                sequence: subject.name.clone(),
                set: Some(subject.set),
                treatment: run.treatment,
                stage,
                scores,
            });
        }
    }
    Ok(evaluation)
}

/// A builder at work, and what is counted on the way.
struct Run {
    treatment: Treatment,
    builder: MapBuilder,
    masks: MaskScore,
    reports: Vec<FrameReport>,
}

impl Run {
    fn new(treatment: Treatment) -> Result<Self, AnyError> {
        Ok(Self {
            treatment,
            builder: MapBuilder::new(treatment.config())?,
            masks: MaskScore::default(),
            reports: Vec::new(),
        })
    }

    fn insert(&mut self, frame: &SimulatedFrame) -> Result<(), AnyError> {
        let detections = self.treatment.detections(&frame.detections);
        let pose = &frame.estimated_world_from_camera;
        self.reports.push(self.builder.insert(&frame.frame, &detections, pose)?);
        let masked = inverted(self.builder.preprocessor().static_mask())?;
        self.masks.add(&masked, &frame.mover_mask, frame.frame.depth())?;
        Ok(())
    }

    fn score_all_but_the_cloud(&self, scores: &mut Scores) {
        scores.set("mask.recall", self.masks.recall());
        scores.set("mask.precision", self.masks.precision());
        self.score_speed(scores);
    }

    fn score_speed(&self, scores: &mut Scores) {
        for &(key, stage) in SPEED_COLUMNS {
            let time = |report: &FrameReport| report.stages.of(stage).as_secs_f64() * 1e3;
            scores.set(key, Milliseconds::of(self.reports.iter().map(time).collect()).median_ms / 1e3);
        }
        let total = |report: &FrameReport| report.stages.total().as_secs_f64() * 1e3;
        let insert = Milliseconds::of(self.reports.iter().map(total).collect());
        scores.set("speed.insert", insert.median_ms / 1e3);
        scores.set("speed.insert_p95", insert.p95_ms / 1e3);
    }
}

/// The steps that are timed, by column.
const SPEED_COLUMNS: &[(&str, dymlm::Stage)] = &[
    ("speed.tracking", dymlm::Stage::Tracking),
    ("speed.foreground", dymlm::Stage::Foreground),
    ("speed.compensation", dymlm::Stage::Compensation),
    ("speed.correction", dymlm::Stage::Correction),
    ("speed.mask", dymlm::Stage::Mask),
    ("speed.cloud", dymlm::Stage::Cloud),
    ("speed.octree", dymlm::Stage::Octree),
];

fn score_of_cloud(scores: &mut Scores, cloud: &PointCloud, truth: &Truth) {
    let Some(score) = score_cloud(cloud, truth) else { return };
    scores.set("cloud.residue", score.residue);
    scores.set("cloud.stray", score.stray);
    scores.set("cloud.completeness", score.completeness);
    scores.set("cloud.median", score.median_distance);
    scores.set("cloud.p95", score.p95_distance);
}

/// `true` where `mask` is not.
pub(crate) fn inverted(mask: &Mask) -> Result<Mask, AnyError> {
    Ok(Mask::new(mask.width(), mask.height(), mask.data().iter().map(|choice| !choice).collect())?)
}

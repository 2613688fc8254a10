use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use dymlm::Selection;
use dymlm_examples::{AnyError, SequenceSet, progress_bar};
use dymlm_sim::FrameScratch;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::change_watch::ChangeWatch;
use crate::columns::Scores;
use crate::drift::Poses;
use crate::floor_plan::PlanPicture;
use crate::residue_picture::Panel;
use crate::run::Run;
use crate::standard::Standard;
use crate::subjects::Subject;
use crate::treatment::{Detector, Treatment};

/// One row of the table.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    /// Name of the sequence.
    pub(crate) sequence: String,
    /// The set it belongs to; none for means.
    #[serde(skip)]
    pub(crate) set: Option<SequenceSet>,
    /// The treatment of movers.
    pub(crate) treatment: Treatment,
    /// The frames in which the detector ran.
    pub(crate) detector: Detector,
    /// The source of the poses.
    pub(crate) poses: Poses,
    /// Before or after late removal.
    pub(crate) stage: Stage,
    /// The figures.
    pub(crate) scores: Scores,
}

/// Before or after late removal (ghosts by the evidence of all frames, noise by thinning). It affects only
/// the cloud; the other maps are scored in the rows of the finished cloud.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Stage {
    /// The cloud with everything that was inserted.
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

/// The results of one sequence.
pub(crate) struct Evaluation {
    /// Its rows of the table.
    pub(crate) rows: Vec<Row>,
    /// The cloud of each row from above with the residue marked; none when there is only one treatment of
    /// movers.
    pub(crate) panels: Vec<Panel>,
    /// The map of a building made from a floor plan beside the plan: the last one drawn.
    pub(crate) beside_plan: Option<PlanPicture>,
}

/// The variants of the input, one builder for each combination, and for each of the subject's detectors.
pub(crate) struct Ways<'a> {
    /// The treatments of movers.
    pub(crate) treatments: &'a [Treatment],
    /// Detections of a lower score are left out.
    pub(crate) min_score: f32,
    /// The kinds of poses, and whether the maps are corrected at the end.
    pub(crate) poses: &'a [Poses],
}

/// Maps every subject in every variant, one sequence on each core. The rows are in the order of the subjects,
/// whichever finishes first, and except for the times do not depend on the number of cores.
pub(crate) fn evaluate(subjects: &[Subject], ways: &Ways<'_>) -> Result<Vec<Evaluation>, AnyError> {
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
            let evaluation = evaluate_subject(subject, ways, &bar);
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

/// Renders each frame once and inserts it into the builder of each variant.
fn evaluate_subject(subject: &Subject, ways: &Ways<'_>, bar: &ProgressBar) -> Result<Evaluation, AnyError> {
    let mut standard = Standard::new(&subject.sequence)?;
    let mut runs = runs(ways, subject)?;
    let mut watches: Vec<ChangeWatch> = runs.iter().map(|_| ChangeWatch::new(&subject.sequence)).collect();
    let mut scratch = FrameScratch::default();
    for (index, drifting) in subject.drifting.iter().enumerate() {
        let frame =
            subject.sequence.frame_with(index, &mut scratch).ok_or("a frame could not be rendered")?;
        standard.observe(&frame)?;
        for (run, watch) in runs.iter_mut().zip(&mut watches) {
            run.insert(&frame, drifting)?;
            watch.check(&frame, run.map(), standard.truth());
        }
        scratch.recycle(frame);
        bar.inc(1);
    }
    let scoring = Scoring { standard: &standard, subject, compares: ways.treatments.len() > 1 };
    let mut evaluation = Evaluation { rows: Vec::new(), panels: Vec::new(), beside_plan: None };
    for (run, watch) in runs.iter_mut().zip(&watches) {
        run.finish();
        if matches!(run.poses(), Poses::Corrected | Poses::Refined) {
            scoring.score(run, watch, Poses::Drifting, &mut evaluation)?;
            run.correct()?;
        }
        scoring.score(run, watch, run.poses(), &mut evaluation)?;
    }
    Ok(evaluation)
}

/// A builder for each variant.
fn runs(ways: &Ways<'_>, subject: &Subject) -> Result<Vec<Run>, AnyError> {
    let Ways { treatments, min_score, poses } = *ways;
    let mut runs = Vec::new();
    for &treatment in treatments {
        for &detector in &subject.detectors {
            for &poses in poses {
                runs.push(Run::new(treatment, detector, min_score, subject.sensor, poses)?);
            }
        }
    }
    Ok(runs)
}

/// Scores maps against the truth.
struct Scoring<'a> {
    standard: &'a Standard,
    subject: &'a Subject,
    /// Whether there is more than one treatment of movers: then the cloud is scored before and after late
    /// removal, with pictures.
    compares: bool,
}

impl Scoring<'_> {
    /// Adds the rows of the maps in their current state, built with `poses`.
    fn score(
        &self,
        run: &Run,
        watch: &ChangeWatch,
        poses: Poses,
        evaluation: &mut Evaluation,
    ) -> Result<(), AnyError> {
        let (standard, subject) = (self.standard, self.subject);
        let stages: &[Stage] = if self.compares { &[Stage::Before, Stage::After] } else { &[Stage::After] };
        for &stage in stages {
            let cloud = run.map().cloud().point_cloud(stage.selection());
            let mut scores = Scores::default();
            standard.score_cloud(&cloud, &mut scores);
            if stage == Stage::After {
                evaluation.beside_plan =
                    PlanPicture::draw(run.map(), &cloud, standard.truth(), &subject.sequence);
                standard.score_octree(run.map().octree(), &mut scores)?;
                standard.score_planes(run.map().planes(), &mut scores);
                standard.score_objects(run.map().objects(), run.detected(), &mut scores);
                watch.score(standard.truth(), &mut scores);
                run.score(&mut scores);
            }
            if self.compares {
                evaluation.panels.push(Panel::draw(&cloud, standard.truth(), &subject.sequence));
            }
            evaluation.rows.push(Row {
                sequence: subject.name.clone(),
                set: Some(subject.set),
                treatment: run.treatment(),
                detector: run.detector(),
                poses,
                stage,
                scores,
            });
        }
        Ok(())
    }
}

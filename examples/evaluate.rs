//! Measures the cloud map: how much of the moving people is left in it, and how much of the room is missing.
//!
//! Without arguments on the built-in sequence against its exact truth; with `--dataset DIR --reference DIR` on a
//! recording against another recording of the same place without people. Rows: what is done about movers; columns:
//! masks against exact masks where there are any, and the cloud before and after what is removed late (ghosts by the
//! evidence of all frames, noise by thinning).

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::path::{Path, PathBuf};

use clap::Parser;
use dymlm::core::{Detection, Mask, Point, PointCloud};
use dymlm::dynamics::MaskMode;
use dymlm::{MapBuilder, MapConfig, Selection};
use dymlm_examples::{AnyError, FrameSource, SourceFrame, every, progress_bar};
use dymlm_io::TumOptions;
use dymlm_sim::{MaskScore, ReferenceCloud, Sequence, SequenceConfig, Truth, TruthConfig, score_cloud};

/// Measures residue, completeness and masks, one row for each way of treating movers.
#[derive(Parser)]
struct Arguments {
    /// TUM RGB-D folder with people; exact masks in masks/ are used when there are any
    #[arg(long, requires = "reference")]
    dataset: Option<PathBuf>,
    /// The same place without people: all frames stitched as they are
    #[arg(long, requires = "dataset")]
    reference: Option<PathBuf>,
    /// Detection file; default: the dataset's detections.jsonl
    #[arg(long)]
    detections: Option<PathBuf>,
    /// Only every N-th frame
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Only the default way of treating movers (silhouettes, all detections)
    #[arg(long)]
    only_default: bool,
}

/// What is done about movers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Treatment {
    NoDetections,
    RawBoxes,
    Compensation,
    Correction,
    Silhouettes,
}

impl Treatment {
    fn name(self) -> &'static str {
        match self {
            Self::NoDetections => "no detections",
            Self::RawBoxes => "raw boxes",
            Self::Compensation => "boxes, compensation",
            Self::Correction => "boxes, + correction",
            Self::Silhouettes => "silhouettes",
        }
    }

    fn config(self) -> MapConfig {
        let mut config = MapConfig::default();
        if self != Self::Silhouettes {
            config.dynamics.mask.mode = MaskMode::Box;
        }
        if matches!(self, Self::RawBoxes | Self::Compensation) {
            config.dynamics.correction.max_extension = 0.0;
        }
        if self == Self::RawBoxes {
            config.dynamics.tracker.max_coast = 0.0;
        }
        config
    }
}

/// One row of the table.
#[derive(Debug, Clone, Copy)]
struct Row {
    treatment: Treatment,
    min_score: f32,
}

/// Detections below it never reach the builder.
const MIN_SCORES: [f32; 2] = [0.0, 0.7];

fn rows(arguments: &Arguments) -> Vec<Row> {
    use Treatment::{Compensation, Correction, NoDetections, RawBoxes, Silhouettes};
    if arguments.only_default {
        return vec![Row { treatment: Silhouettes, min_score: 0.0 }];
    }
    let mut rows = vec![Row { treatment: NoDetections, min_score: 0.0 }];
    for min_score in MIN_SCORES {
        rows.extend(
            [RawBoxes, Compensation, Correction, Silhouettes].map(|treatment| Row { treatment, min_score }),
        );
    }
    rows
}

/// What maps are held against.
enum Standard {
    Reference(ReferenceCloud),
    Truth(Box<Truth>),
}

fn main() -> Result<(), AnyError> {
    let arguments = Arguments::parse();
    let standard = open_standard(&arguments)?;
    print_header(&standard);
    for row in rows(&arguments) {
        let mut source = open_source(&arguments)?;
        let (builder, masks) = map_sequence(row, &mut source, &arguments)?;
        print_row(row, &builder, masks, &standard);
    }
    Ok(())
}

fn open_source(arguments: &Arguments) -> Result<FrameSource, AnyError> {
    match &arguments.dataset {
        Some(folder) => FrameSource::recorded(folder, arguments.detections.as_deref(), &options(arguments)),
        None => FrameSource::synthetic(&sequence_config(arguments)),
    }
}

fn options(arguments: &Arguments) -> TumOptions {
    let mut options = TumOptions::default();
    options.every = arguments.every;
    options
}

fn sequence_config(arguments: &Arguments) -> SequenceConfig {
    every(SequenceConfig::default(), arguments.every)
}

fn open_standard(arguments: &Arguments) -> Result<Standard, AnyError> {
    let Some(folder) = &arguments.reference else {
        let sequence = Sequence::new(&sequence_config(arguments))?;
        let truth = Truth::of(&sequence, &TruthConfig::default())?;
        return Ok(Standard::Truth(Box::new(truth)));
    };
    // All frames, whatever is left out of the map: what can be asked for does not depend on it.
    let mut source = FrameSource::recorded(folder, None, &TumOptions::default())?;
    let range = MapConfig::default().cloud;
    let mut reference = ReferenceCloud::new(0.02)?;
    let bar = progress_bar(source.len(), "reference");
    for index in 0..source.len() {
        let next = source.load(index)?;
        let (near, far) = (range.min_depth as f32, range.max_depth as f32);
        reference.add_frame(&next.frame, &next.world_from_camera, near, far);
        source.recycle(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Standard::Reference(reference))
}

/// Builds the map of one row; scores its masks on the way where exact masks are known.
fn map_sequence(
    row: Row,
    source: &mut FrameSource,
    arguments: &Arguments,
) -> Result<(MapBuilder, MaskScore), AnyError> {
    let mut builder = MapBuilder::new(row.treatment.config())?;
    let mut masks = MaskScore::default();
    let bar = progress_bar(source.len(), row.treatment.name());
    for index in 0..source.len() {
        let next = source.load(index)?;
        let detections: Vec<Detection> = match row.treatment {
            Treatment::NoDetections => Vec::new(),
            _ => next.detections.iter().filter(|d| d.score() >= row.min_score).cloned().collect(),
        };
        builder.insert(&next.frame, &detections, &next.world_from_camera)?;
        if let Some(movers) = exact_movers(index, source, arguments, &next)? {
            let masked = inverted(builder.preprocessor().static_mask())?;
            masks.add(&masked, &movers, next.frame.depth())?;
        }
        source.recycle(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((builder, masks))
}

/// The pixels that show movers, exactly; `None` when nobody knows.
fn exact_movers(
    index: usize,
    source: &FrameSource,
    arguments: &Arguments,
    frame: &SourceFrame,
) -> Result<Option<Mask>, AnyError> {
    if let Some(movers) = &frame.mover_mask {
        return Ok(Some(movers.clone()));
    }
    let Some(folder) = arguments.dataset.as_ref().map(|folder| folder.join("masks")) else { return Ok(None) };
    if !folder.is_dir() {
        return Ok(None);
    }
    let (width, height) = (frame.frame.camera().width(), frame.frame.camera().height());
    let name = source.color_path(index).and_then(|path| path.file_stem().map(|stem| folder.join(stem)));
    match name.map(|path| path.with_extension("png")).filter(|path| path.exists()) {
        Some(path) => Ok(Some(read_mask(&path)?)),
        // Frames without people have no mask.
        None => Ok(Some(Mask::filled(width, height, false)?)),
    }
}

fn read_mask(path: &Path) -> Result<Mask, AnyError> {
    let image = image::open(path)?.into_luma8();
    let data = image.as_raw().iter().map(|&value| value > 0).collect();
    Ok(Mask::new(image.width() as usize, image.height() as usize, data)?)
}

fn inverted(mask: &Mask) -> Result<Mask, AnyError> {
    Ok(Mask::new(mask.width(), mask.height(), mask.data().iter().map(|choice| !choice).collect())?)
}

fn print_header(standard: &Standard) {
    print!("{:<20} {:>5} | {:>7} {:>9}", "treatment", "score", "recall", "precision");
    for stage in ["before", "after"] {
        match standard {
            Standard::Reference(_) => print!(" | {stage:>6}: residue complete"),
            Standard::Truth(_) => {
                print!(" | {stage:>6}: residue   stray complete  median     p95");
            }
        }
    }
    println!();
}

fn print_row(row: Row, builder: &MapBuilder, masks: MaskScore, standard: &Standard) {
    let percent =
        |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{:.2} %", 100.0 * share));
    print!("{:<20} {:>5.2} |", row.treatment.name(), row.min_score);
    print!(" {:>7} {:>9}", percent(masks.recall()), percent(masks.precision()));
    for selection in [Selection::All, Selection::Static] {
        let cloud = builder.map().cloud().point_cloud(selection);
        print!(" | {}", score(&cloud, standard));
    }
    println!();
}

fn score(cloud: &PointCloud, standard: &Standard) -> String {
    let points: &[Point] = cloud.points();
    match standard {
        Standard::Reference(reference) => {
            let score = reference.score(points);
            format!("{:>13.4} % {:>6.2} %", 100.0 * score.residue, 100.0 * score.completeness)
        }
        Standard::Truth(truth) => score_cloud(cloud, truth).map_or("-".to_owned(), |score| {
            format!(
                "{:>13.4} % {:>5.2} % {:>6.2} % {:>4.1} mm {:>4.1} mm",
                100.0 * score.residue,
                100.0 * score.stray,
                100.0 * score.completeness,
                1e3 * score.median_distance,
                1e3 * score.p95_distance,
            )
        }),
    }
}

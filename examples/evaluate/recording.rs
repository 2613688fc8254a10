//! Compares a recording with people to one of the same place without people. Rows: the treatments of movers,
//! with all detections and with only the surer ones. Columns: the masks compared with exact masks, if there
//! are any, and the cloud before and after late removal.

use std::path::Path;

use dymlm::core::{Detection, PointCloud};
use dymlm::{MapBuilder, MapConfig, Selection};
use dymlm_examples::{AnyError, FrameSource, progress_bar};
use dymlm_io::TumOptions;
use dymlm_metrics::{MaskScore, ReferenceCloud};

use crate::treatment::Treatment;

/// One row of the table.
#[derive(Debug, Clone, Copy)]
struct Row {
    treatment: Treatment,
    min_score: f32,
}

/// Detections with lower scores are withheld from the builder.
const MIN_SCORES: [f32; 2] = [0.0, 0.7];

fn rows() -> Vec<Row> {
    use Treatment::{Compensation, Correction, NoDetections, RawBoxes, Silhouettes};
    let mut rows = vec![Row { treatment: NoDetections, min_score: 0.0 }];
    for min_score in MIN_SCORES {
        rows.extend(
            [RawBoxes, Compensation, Correction, Silhouettes].map(|treatment| Row { treatment, min_score }),
        );
    }
    rows
}

/// Prints the table of the recording in `dataset`, compared with the one in `reference`.
pub(crate) fn evaluate(
    dataset: &Path,
    reference: &Path,
    detections: Option<&Path>,
    every: usize,
) -> Result<(), AnyError> {
    let reference = stitch(reference)?;
    let mut options = TumOptions::default();
    options.every = every;
    print_header();
    for row in rows() {
        let mut source = FrameSource::recorded(dataset, detections, &options)?;
        let (builder, masks) = map_recording(row, &mut source)?;
        print_row(row, &builder, masks, &reference);
    }
    Ok(())
}

/// Adds all frames of the reference, even if `--every` leaves frames out of the map, so that the reference
/// does not depend on it.
fn stitch(folder: &Path) -> Result<ReferenceCloud, AnyError> {
    let mut source = FrameSource::recorded(folder, None, &TumOptions::default())?;
    let range = MapConfig::default().sensor;
    let mut reference = ReferenceCloud::new(0.02)?;
    let bar = progress_bar(source.len(), "reference");
    for index in 0..source.len() {
        let next = source.load(index)?;
        reference.add_frame(&next.frame, &next.world_from_camera, range.min_depth, range.max_depth);
        source.recycle(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(reference)
}

/// Builds the map of one row, and scores its masks if exact masks are known.
fn map_recording(row: Row, source: &mut FrameSource) -> Result<(MapBuilder, MaskScore), AnyError> {
    let mut builder = MapBuilder::new(row.treatment.config())?;
    let mut masks = MaskScore::default();
    let bar = progress_bar(source.len(), row.treatment.name());
    for index in 0..source.len() {
        let next = source.load(index)?;
        let chosen = |found: &[Detection]| -> Vec<Detection> {
            found.iter().filter(|detection| detection.score() >= row.min_score).cloned().collect()
        };
        // Without detections, the detector has not run: it has not looked and found nothing.
        let found = next.detections.as_deref().filter(|_| row.treatment != Treatment::NoDetections);
        let detections = found.map(chosen);
        builder.insert(&next.frame, detections.as_deref(), &next.world_from_camera)?;
        if let Some(people) = source.people(index)? {
            let masked = builder.preprocessor().static_mask().inverted();
            masks.add(&masked, &people.anybody()?, next.frame.depth())?;
        }
        source.recycle(next);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok((builder, masks))
}

fn print_header() {
    print!("{:<20} {:>5} | {:>7} {:>9}", "treatment", "score", "recall", "precision");
    println!(" | before: residue complete |  after: residue complete");
}

fn print_row(row: Row, builder: &MapBuilder, masks: MaskScore, reference: &ReferenceCloud) {
    let percent =
        |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{:.2} %", 100.0 * share));
    print!("{:<20} {:>5.2} |", row.treatment.name(), row.min_score);
    print!(" {:>7} {:>9}", percent(masks.recall()), percent(masks.precision()));
    for selection in [Selection::All, Selection::Static] {
        let cloud: PointCloud = builder.map().cloud().point_cloud(selection);
        let score = reference.score(cloud.points());
        print!(" | {:>13.4} % {:>6.2} %", 100.0 * score.residue, 100.0 * score.completeness);
    }
    println!();
}

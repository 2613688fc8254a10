use dymlm_examples::AnyError;

use crate::drift::Poses;
use crate::evaluation::{Row, Stage};
use crate::treatment::Treatment;

/// The limit of a figure, set a little worse than the figure's value at that time.
#[derive(Clone, Copy)]
pub(crate) enum Limit {
    AtLeast(f64),
    AtMost(f64),
}
use Limit::{AtLeast, AtMost};

/// A limit for a sequence (part of its name) and a column.
pub(crate) type SequenceLimit = (&'static str, &'static str, Limit);

/// Limits for the quick run.
pub(crate) const QUICK: &[SequenceLimit] = &[
    ("walking", "mask.recall", AtLeast(0.97)),
    ("walking", "boxes.mota", AtLeast(0.75)),
    ("walking", "cloud.residue", AtMost(0.0002)),
    ("walking", "cloud.completeness", AtLeast(0.99)),
    ("walking", "cloud.median", AtMost(0.006)),
    ("walking", "cloud.static_accuracy", AtLeast(0.99)),
    ("walking", "cloud.dynamic_accuracy", AtLeast(0.99)),
    // Of what people swept, some 5 % of the free points. Measured: none of some thousand points; the limit
    // leaves room for two in a thousand.
    ("walking", "octree.ghosts", AtMost(0.002)),
    ("walking", "octree.completeness", AtLeast(0.99)),
    ("walking", "octree.residue", AtMost(0.001)),
    ("walking", "planes.recall", AtLeast(0.85)),
    ("walking", "planes.precision", AtLeast(0.94)),
    ("walking", "planes.duplicates", AtMost(0.0)),
    ("walking", "planes.angle", AtMost(0.007)),
    ("walking", "planes.offset", AtMost(0.002)),
    ("walking", "objects.recall", AtLeast(0.9)),
    ("walking", "objects.precision", AtLeast(0.9)),
    ("walking", "objects.iou", AtLeast(0.6)),
    ("walking", "objects.center", AtMost(0.02)),
    ("walking", "objects.labels", AtLeast(0.95)),
    ("sitting", "mask.recall", AtLeast(0.97)),
    ("sitting", "mask.precision", AtLeast(0.65)),
    ("sitting", "cloud.residue", AtMost(0.0004)),
    ("sitting", "cloud.completeness", AtLeast(0.985)),
    ("sitting", "cloud.completeness_near_people", AtLeast(0.96)),
    ("sitting", "cloud.associated_accuracy", AtLeast(0.97)),
    ("sitting", "octree.residue", AtMost(0.001)),
    ("sitting", "planes.recall", AtLeast(0.77)),
    ("sitting", "planes.precision", AtLeast(0.94)),
    ("sitting", "objects.recall", AtLeast(0.9)),
    ("sitting", "objects.precision", AtLeast(0.85)),
    ("sitting", "objects.iou", AtLeast(0.58)),
];

/// Limits for the run over depth cameras, which hold with every third frame too. A stereo pair finds fewer
/// planes than the others: it is used up to 4 m, and walls beyond are out of its patches' range.
pub(crate) const SENSORS: &[SequenceLimit] = &[
    ("kinect", "cloud.residue", AtMost(0.0005)),
    ("kinect", "cloud.completeness", AtLeast(0.99)),
    ("kinect", "cloud.median", AtMost(0.008)),
    ("kinect", "planes.recall", AtLeast(0.8)),
    ("kinect", "mask.recall", AtLeast(0.85)),
    ("kinect", "objects.recall", AtLeast(0.9)),
    ("stereo", "cloud.residue", AtMost(0.0005)),
    ("stereo", "cloud.completeness", AtLeast(0.99)),
    ("stereo", "cloud.median", AtMost(0.008)),
    ("stereo", "planes.recall", AtLeast(0.75)),
    ("stereo", "planes.precision", AtLeast(0.85)),
    ("stereo", "mask.recall", AtLeast(0.85)),
    ("stereo", "objects.recall", AtLeast(0.9)),
    ("time of flight", "cloud.residue", AtMost(0.0005)),
    ("time of flight", "cloud.completeness", AtLeast(0.99)),
    ("time of flight", "cloud.median", AtMost(0.008)),
    ("time of flight", "planes.recall", AtLeast(0.8)),
    ("time of flight", "mask.recall", AtLeast(0.85)),
    ("time of flight", "objects.recall", AtLeast(0.9)),
    ("320x240", "cloud.residue", AtMost(0.0005)),
    ("320x240", "cloud.completeness", AtLeast(0.99)),
    ("320x240", "cloud.median", AtMost(0.008)),
    ("320x240", "planes.recall", AtLeast(0.8)),
    ("320x240", "mask.recall", AtLeast(0.85)),
    ("320x240", "objects.recall", AtLeast(0.9)),
    ("1280x720", "cloud.residue", AtMost(0.0005)),
    ("1280x720", "cloud.completeness", AtLeast(0.99)),
    ("1280x720", "cloud.median", AtMost(0.008)),
    ("1280x720", "planes.recall", AtLeast(0.8)),
    ("1280x720", "mask.recall", AtLeast(0.85)),
    ("1280x720", "objects.recall", AtLeast(0.9)),
    ("110 degrees", "cloud.residue", AtMost(0.0005)),
    ("110 degrees", "cloud.completeness", AtLeast(0.99)),
    ("110 degrees", "cloud.median", AtMost(0.008)),
    ("110 degrees", "planes.recall", AtLeast(0.75)),
    ("110 degrees", "mask.recall", AtLeast(0.9)),
    ("110 degrees", "objects.recall", AtLeast(0.9)),
    ("rolled", "cloud.residue", AtMost(0.0005)),
    ("rolled", "cloud.completeness", AtLeast(0.99)),
    ("rolled", "cloud.median", AtMost(0.008)),
    ("rolled", "planes.recall", AtLeast(0.75)),
    ("rolled", "mask.recall", AtLeast(0.85)),
    ("rolled", "objects.recall", AtLeast(0.9)),
];

/// Limits for the run with a detector that is slower than the camera, down to [`SLOWEST_DETECTOR`].
pub(crate) const SLOW_DETECTOR: &[SequenceLimit] = &[
    ("sitting", "cloud.residue", AtMost(0.001)),
    ("sitting", "cloud.completeness", AtLeast(0.98)),
    ("sitting", "objects.recall", AtLeast(0.75)),
    ("walking", "cloud.residue", AtMost(0.0005)),
    ("walking", "cloud.completeness", AtLeast(0.99)),
    ("walking", "objects.recall", AtLeast(0.9)),
];
/// Detections a second below which nothing is asked: somebody who walks is gone between two of them.
pub(crate) const SLOWEST_DETECTOR: f64 = 2.0;

/// Limits for the run with undetected movers, which hold with every third frame too.
pub(crate) const UNDETECTED: &[SequenceLimit] = &[
    ("nobody detected, walking", "cloud.residue", AtMost(0.0005)),
    // Measured: none, with each frame and with every third.
    ("nobody detected, walking", "octree.ghosts", AtMost(0.002)),
    ("nobody detected, walking", "mask.recall", AtLeast(0.7)),
    ("nobody detected, walking", "mask.precision", AtLeast(0.9)),
    ("one of two detected", "cloud.residue", AtMost(0.0005)),
    ("one of two detected", "mask.recall", AtLeast(0.9)),
    ("trolley, one walks", "cloud.residue", AtMost(0.001)),
    ("trolley, one walks", "mask.recall", AtLeast(0.85)),
    ("chair", "cloud.residue", AtMost(0.0005)),
    ("chair", "changes.cloud.gone", AtMost(10.0)),
    ("chair", "changes.octree.gone", AtMost(10.0)),
    ("chair", "changes.objects.gone", AtMost(10.0)),
    ("chair", "changes.cloud.there", AtMost(10.0)),
    ("chair", "changes.octree.there", AtMost(10.0)),
    ("chair", "changes.objects.there", AtMost(10.0)),
    ("partition comes", "changes.cloud.there", AtMost(10.0)),
    ("partition comes", "changes.octree.there", AtMost(10.0)),
    ("partition comes", "changes.planes.there", AtMost(10.0)),
];

/// Limits for the run through a building, which hold with every second frame too. Planes have no limits:
/// coplanar walls of two rooms become one plane, and round pillars several.
pub(crate) const BUILDING: &[SequenceLimit] = &[
    ("building", "cloud.residue", AtMost(0.001)),
    ("building", "cloud.completeness", AtLeast(0.98)),
    ("building", "objects.recall", AtLeast(0.9)),
    ("building", "objects.precision", AtLeast(0.95)),
];

/// Fails when a figure of any row that is judged is worse than its limit or missing; the error says which.
pub(crate) fn check(rows: &[Row], limits: &[SequenceLimit]) -> Result<(), AnyError> {
    let mut faults = Vec::new();
    for &(sequence, key, limit) in limits {
        let of_sequence = judged(rows).filter(|row| row.sequence.contains(sequence));
        let mut values: Vec<f64> = of_sequence.map(|row| row.scores.get(key).unwrap_or(f64::NAN)).collect();
        if values.is_empty() {
            values.push(f64::NAN);
        }
        for value in values {
            let (holds, bound) = match limit {
                AtLeast(bound) => (value >= bound, format!("at least {bound}")),
                AtMost(bound) => (value <= bound, format!("at most {bound}")),
            };
            if !holds {
                faults.push(format!("{sequence}: {key} is {value}, not {bound}"));
            }
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n").into()) }
}

/// The rows to which limits apply: of finished maps, with our own treatment of movers unless another was
/// asked for. What poses that drift do to maps is measured, not judged.
fn judged(rows: &[Row]) -> impl Iterator<Item = &Row> {
    let has_own = rows.iter().any(|row| row.treatment == Treatment::Silhouettes);
    let is_own = move |row: &&Row| !has_own || row.treatment == Treatment::Silhouettes;
    let finished = rows.iter().filter(|row| row.stage == Stage::After && row.poses != Poses::Drifting);
    finished.filter(is_own)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::Scores;
    use crate::treatment::Detector;

    fn row(treatment: Treatment, stage: Stage, poses: Poses, recall: f64) -> Row {
        let mut scores = Scores::default();
        scores.set("objects.recall", recall);
        let (sequence, detector) = ("building".to_owned(), Detector::EveryFrame);
        Row { sequence, set: None, treatment, detector, poses, stage, scores }
    }

    #[test]
    fn each_row_that_is_judged_is_held_to_the_limit() {
        let limits: &[SequenceLimit] = &[("building", "objects.recall", AtLeast(0.9))];
        let good = row(Treatment::Silhouettes, Stage::After, Poses::True, 0.95);
        let bad = row(Treatment::Silhouettes, Stage::After, Poses::Corrected, 0.8);
        let others = [
            row(Treatment::NoDetections, Stage::After, Poses::True, f64::NAN),
            row(Treatment::Silhouettes, Stage::Before, Poses::True, f64::NAN),
            row(Treatment::Silhouettes, Stage::After, Poses::Drifting, 0.2),
        ];
        let with =
            |judged: &[&Row]| -> Vec<Row> { others.iter().chain(judged.iter().copied()).cloned().collect() };
        check(&with(&[&good]), limits).unwrap();
        assert!(check(&with(&[&good, &bad]), limits).is_err());
        assert!(check(&with(&[]), limits).is_err(), "a sequence without a row meets no limit");
    }
}

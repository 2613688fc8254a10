use dymlm_examples::AnyError;

use crate::evaluation::Row;

/// What a figure must not be worse than: a little under what stood when it was set.
#[derive(Clone, Copy)]
pub(crate) enum Limit {
    AtLeast(f64),
    AtMost(f64),
}
use Limit::{AtLeast, AtMost};

/// A limit for a sequence (part of its name) and a column.
pub(crate) type SequenceLimit = (&'static str, &'static str, Limit);

/// Limits of the quick run.
pub(crate) const QUICK: &[SequenceLimit] = &[
    ("walking", "mask.recall", AtLeast(0.97)),
    ("walking", "boxes.mota", AtLeast(0.75)),
    ("walking", "cloud.residue", AtMost(0.0002)),
    ("walking", "cloud.completeness", AtLeast(0.99)),
    ("walking", "cloud.median", AtMost(0.006)),
    ("walking", "cloud.static_accuracy", AtLeast(0.99)),
    ("walking", "cloud.dynamic_accuracy", AtLeast(0.99)),
    ("walking", "octree.ghosts", AtMost(0.0005)),
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
    ("sitting", "mask.recall", AtLeast(0.96)),
    ("sitting", "cloud.residue", AtMost(0.012)),
    ("sitting", "cloud.completeness", AtLeast(0.95)),
    ("sitting", "cloud.dynamic_accuracy", AtLeast(0.75)),
    ("sitting", "octree.residue", AtMost(0.008)),
    ("sitting", "planes.recall", AtLeast(0.77)),
    ("sitting", "planes.precision", AtLeast(0.94)),
    ("sitting", "objects.recall", AtLeast(0.9)),
    ("sitting", "objects.precision", AtLeast(0.85)),
    ("sitting", "objects.iou", AtLeast(0.58)),
];

/// Limits of the run over depth cameras.
pub(crate) const SENSORS: &[SequenceLimit] = &[];

/// Fails when a figure is worse than its limit, or missing; says which.
pub(crate) fn check(rows: &[Row], limits: &[SequenceLimit]) -> Result<(), AnyError> {
    let mut faults = Vec::new();
    for &(sequence, key, limit) in limits {
        let row = rows.iter().find(|row| row.sequence.contains(sequence));
        let value = row.and_then(|row| row.scores.get(key)).unwrap_or(f64::NAN);
        let (holds, bound) = match limit {
            AtLeast(bound) => (value >= bound, format!("at least {bound}")),
            AtMost(bound) => (value <= bound, format!("at most {bound}")),
        };
        if !holds {
            faults.push(format!("{sequence}: {key} is {value}, not {bound}"));
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n").into()) }
}

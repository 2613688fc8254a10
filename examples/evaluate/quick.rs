use dymlm_examples::AnyError;

use crate::evaluation::Row;

/// What a figure must not be worse than: a little under what stood when it was set.
#[derive(Clone, Copy)]
enum Limit {
    AtLeast(f64),
    AtMost(f64),
}
use Limit::{AtLeast, AtMost};

/// Limits of the quick run, for each sequence (part of its name) and column.
const LIMITS: &[(&str, &str, Limit)] = &[
    ("walking", "cloud.residue", AtMost(0.0005)),
    ("walking", "cloud.completeness", AtLeast(0.98)),
    ("sitting", "cloud.residue", AtMost(0.0005)),
    ("sitting", "cloud.completeness", AtLeast(0.98)),
];

/// Fails when a figure is worse than its limit, or missing; says which.
pub(crate) fn check(rows: &[Row]) -> Result<(), AnyError> {
    let mut faults = Vec::new();
    for &(sequence, key, limit) in LIMITS {
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

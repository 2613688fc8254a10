use dymlm_core::vector3::{difference, norm};

use crate::MapObject;

/// Least intersection over union of two objects' boxes, 0..=1, for them to be duplicates: solid things do not
/// overlap. A lower value merges neighbours, a higher one keeps one thing seen from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same for different labels: detectors report one thing under two labels at once. A lower value makes a
/// cup on a book part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;

/// Whether two objects are duplicates.
pub(crate) fn are_duplicates(one: &MapObject, other: &MapObject) -> bool {
    let (a, b) = (&one.oriented_box, &other.oriented_box);
    let reach = 0.5 * (norm(a.lengths()) + norm(b.lengths()));
    let least = if one.label == other.label { SAME_IOU } else { SAME_IOU_OTHER_LABEL };
    norm(difference(a.center(), b.center())) <= reach && a.iou(b) >= least
}

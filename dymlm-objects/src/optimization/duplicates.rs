use dymlm_core::vector3::{difference, norm};

use crate::MapObject;

/// Boxes with this intersection over union, 0..=1, are one: solid things do not stand in each other. Lower
/// makes neighbours one, higher keeps what was found of a thing from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same with other labels: detectors report one thing under two names at once. Lower makes a cup on a
/// book a part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;

/// Whether two objects are one.
pub(crate) fn is_one(one: &MapObject, other: &MapObject) -> bool {
    let (a, b) = (&one.oriented_box, &other.oriented_box);
    let reach = 0.5 * (norm(a.lengths()) + norm(b.lengths()));
    let least = if one.label == other.label { SAME_IOU } else { SAME_IOU_OTHER_LABEL };
    norm(difference(a.center(), b.center())) <= reach && a.iou(b) >= least
}

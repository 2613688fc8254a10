use dymlm_core::vector3::{difference, norm};
use dymlm_geometry::OrientedBox;

use crate::MapObject;

/// Least intersection over union of two objects' boxes, 0..=1, for them to be duplicates: solid things do not
/// overlap. A lower value merges neighbours, a higher one keeps one thing seen from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same for different labels: detectors report one thing under two labels at once. A lower value makes a
/// cup on a book part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;

/// Whether two objects are duplicates: their boxes overlap, and the detector did not find them as two things
/// at once, in as many frames as `confirm` an object or in all that saw the lesser one.
pub(crate) fn are_duplicates(one: &MapObject, other: &MapObject, confirm: u32) -> bool {
    let least = if one.label == other.label { SAME_IOU } else { SAME_IOU_OTHER_LABEL };
    // Both count the same.
    let apart = one.seen_apart.frames_with(other.birth);
    apart < confirm.min(one.observations).min(other.observations)
        && may_touch(&one.oriented_box, &other.oriented_box)
        && one.oriented_box.iou(&other.oriented_box) >= least
}

/// Whether the bounding spheres of two boxes touch.
pub(crate) fn may_touch(a: &OrientedBox, b: &OrientedBox) -> bool {
    norm(difference(a.center(), b.center())) <= 0.5 * (norm(a.lengths()) + norm(b.lengths()))
}

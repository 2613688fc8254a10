use dymlm_core::vector3::{difference, norm};
use dymlm_geometry::OrientedBox;

use crate::{MapObject, UpdateConfig};

/// Least intersection over union of two objects' boxes, 0..=1, for them to be duplicates: solid things do not
/// overlap. A lower value merges neighbours, a higher one keeps one thing seen from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same for different labels: detectors report one thing under two labels at once. A lower value makes a
/// cup on a book part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;
/// Least share of an object's box that lies in that of another with the same label for it to be a part of that
/// one: a leg is too small for the intersection over union to say so. Of boxes of one size, a third of each is
/// common at [`SAME_IOU`].
const PART: f64 = 0.5;

/// Whether two objects are duplicates: their boxes overlap, or one is a part of the other, and the detector did
/// not find them as two things at once, in as many frames as confirm an object or in all that saw the lesser
/// one.
pub(crate) fn are_duplicates(one: &MapObject, other: &MapObject, update: &UpdateConfig) -> bool {
    let is_alike = one.label == other.label;
    let least = if is_alike { SAME_IOU } else { SAME_IOU_OTHER_LABEL };
    // Both count the same.
    let apart = one.seen_apart.frames_with(other.birth);
    apart < update.min_observations.min(one.observations).min(other.observations)
        && may_touch(&one.oriented_box, &other.oriented_box)
        && (one.oriented_box.iou(&other.oriented_box) >= least
            || is_alike && (is_part(one, other, update) || is_part(other, one, update)))
}

/// Whether an object is a part of another: it lies mostly within that one, which is better known, and the
/// detector finds it in too few of the looks at it. A thing of its own, beside another whose box has grown over
/// it, is found.
fn is_part(part: &MapObject, whole: &MapObject, update: &UpdateConfig) -> bool {
    let common = || part.oriented_box.intersection_volume(&whole.oriented_box);
    part.observations < whole.observations
        && part.detected_share.share() < update.min_detected_share
        && part.oriented_box.volume() > 0.0
        && common() >= PART * part.oriented_box.volume()
}

/// Whether the bounding spheres of two boxes touch.
pub(crate) fn may_touch(a: &OrientedBox, b: &OrientedBox) -> bool {
    norm(difference(a.center(), b.center())) <= 0.5 * (norm(a.lengths()) + norm(b.lengths()))
}

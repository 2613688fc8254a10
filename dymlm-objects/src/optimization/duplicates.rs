use dymlm_core::vector3::{difference, norm};
use dymlm_geometry::OrientedBox;

use crate::{MapObject, UpdateConfig};

/// Least intersection over union of two objects' boxes, 0..=1, for them to be duplicates: solid things do not
/// overlap. A lower value merges neighbours, a higher one keeps one thing seen from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same for different labels: detectors report one thing under two labels at once. A lower value makes a
/// cup on a book part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;
/// Least share of an object's box that lies in that of a larger object with the same label for it to be a part of that
/// one: a leg is too small for the intersection over union to say so. Of boxes of one size, a third of each is common
/// at [`SAME_IOU`].
const PART: f64 = 0.5;

/// Whether two objects are duplicates: their boxes overlap, or one is a part of the other, and the detector did not
/// find them as two things at once, in as many frames as confirm an object or in all that saw the lesser one.
pub(crate) fn are_duplicates(one: &MapObject, other: &MapObject, update: &UpdateConfig) -> bool {
    // Both count the same.
    let apart = one.seen_apart.frames_with(other.birth);
    apart < update.min_observations.min(one.observations).min(other.observations)
        && may_touch(&one.oriented_box, &other.oriented_box)
        && fill_one_place(one, other, update)
}

fn fill_one_place(one: &MapObject, other: &MapObject, update: &UpdateConfig) -> bool {
    let (own, its) = (&one.oriented_box, &other.oriented_box);
    if one.label != other.label {
        return own.iou(its) >= SAME_IOU_OTHER_LABEL;
    }
    let common = own.intersection_volume(its);
    common > 0.0
        && (common >= SAME_IOU * (own.volume() + its.volume() - common)
            || is_part(one, other, common, update)
            || is_part(other, one, common, update))
}

/// Whether an object is a part of another, with which it has so much volume in common: it lies mostly within that,
/// which is better known, and the detector finds it less often than it finds what hardly looks like its detections. A
/// thing that is there beside another which has taken too much is found.
fn is_part(part: &MapObject, whole: &MapObject, common: f64, update: &UpdateConfig) -> bool {
    part.observations < whole.observations
        && common >= PART * part.oriented_box.volume()
        && part.detected_share.share() < update.min_detected_share
}

/// Whether the bounding spheres of two boxes touch.
pub(crate) fn may_touch(a: &OrientedBox, b: &OrientedBox) -> bool {
    norm(difference(a.center(), b.center())) <= 0.5 * (norm(a.lengths()) + norm(b.lengths()))
}

use dymlm_core::vector3::{difference, norm};

use crate::object_map::ObjectMap;
use crate::{MapObject, ObjectMerge};

/// Boxes with this intersection over union, 0..=1, are one: solid things do not stand in each other. Lower makes
/// neighbours one, higher keeps what was found of a thing from two sides as two.
const SAME_IOU: f64 = 0.2;
/// The same with other labels: detectors report one thing under two names at once. Lower makes a cup on a book a
/// part of the book.
const SAME_IOU_OTHER_LABEL: f64 = 0.4;

/// The first pair of objects that are one; `None` when there is none. The one with fewer observations goes.
///
/// O(n^2) distances, of which only near pairs are looked at.
pub(crate) fn find_duplicates(map: &ObjectMap) -> Option<ObjectMerge> {
    for (place, one) in map.objects.iter().enumerate() {
        for other in &map.objects[place + 1..] {
            if is_one(one, other) {
                let other_goes = other.observations <= one.observations;
                let (kept, removed) = if other_goes { (one.id, other.id) } else { (other.id, one.id) };
                return Some(ObjectMerge { kept, removed });
            }
        }
    }
    None
}

fn is_one(one: &MapObject, other: &MapObject) -> bool {
    let (a, b) = (&one.oriented_box, &other.oriented_box);
    let reach = 0.5 * (norm(a.lengths()) + norm(b.lengths()));
    let least = if one.label == other.label { SAME_IOU } else { SAME_IOU_OTHER_LABEL };
    norm(difference(a.center(), b.center())) <= reach && a.iou(b) >= least
}

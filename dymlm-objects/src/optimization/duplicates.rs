use dymlm_core::vector3::{difference, norm};

use crate::object_map::ObjectMap;
use crate::{MapObject, ObjectMerge};

/// Least intersection over union of the boxes, 0..=1, when the labels are the same.
const MIN_IOU: f64 = 0.2;
/// Or least share of the smaller box that lies in the larger one, 0..=1.
const MIN_INSIDE: f64 = 0.5;
/// Least intersection over union with other labels, 0..=1. Lower makes a cup on a book a part of the book.
const MIN_IOU_OTHER_LABEL: f64 = 0.4;
/// Whatever else, boxes with the same label whose intersection over union is this, 0..=1, are one: solid
/// things do not stand in each other.
const SOLID_IOU: f64 = 0.25;
/// The same with other labels: detectors report one thing under two names at once.
const SOLID_IOU_OTHER_LABEL: f64 = 0.5;
/// Largest share of the less observed object's observations that were in one frame with the other's, 0..=1:
/// what is often seen side by side are two things.
pub(crate) const MAX_TOGETHER: f64 = 0.2;

/// The first pair of objects that are one; `None` when there is none. The one with fewer observations goes.
///
/// O(n^2) distances, of which only near pairs are looked at.
pub(crate) fn find_duplicates(map: &ObjectMap) -> Option<ObjectMerge> {
    for (place, one) in map.objects.iter().enumerate() {
        for other in &map.objects[place + 1..] {
            if is_one(map, one, other) {
                let other_goes = other.observations <= one.observations;
                let (kept, removed) = if other_goes { (one.id, other.id) } else { (other.id, one.id) };
                return Some(ObjectMerge { kept, removed });
            }
        }
    }
    None
}

fn is_one(map: &ObjectMap, one: &MapObject, other: &MapObject) -> bool {
    let (a, b) = (&one.oriented_box, &other.oriented_box);
    let reach = 0.5 * (norm(a.lengths()) + norm(b.lengths()));
    if norm(difference(a.center(), b.center())) > reach {
        return false;
    }
    let shared = a.intersection_volume(b);
    let smaller = a.volume().min(b.volume());
    let inside = if smaller > 0.0 { shared / smaller } else { 0.0 };
    let iou = a.iou(b);
    let overlaps = if one.label == other.label {
        iou >= MIN_IOU || inside >= MIN_INSIDE
    } else {
        iou >= MIN_IOU_OTHER_LABEL
    };
    let together = f64::from(map.together.get(&(one.id, other.id)).copied().unwrap_or(0));
    let fewer = f64::from(one.observations.min(other.observations));
    let solid_iou = if one.label == other.label { SOLID_IOU } else { SOLID_IOU_OTHER_LABEL };
    let is_solid = iou >= solid_iou;
    is_solid || (overlaps && together <= MAX_TOGETHER * fewer)
}

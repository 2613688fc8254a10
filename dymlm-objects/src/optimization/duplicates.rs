use dymlm_core::vector3::{difference, norm};

use super::MergeConfig;
use crate::object_map::ObjectMap;
use crate::{MapObject, ObjectMerge};

/// The first pair of objects that are one; `None` when there is none. The one with fewer observations goes.
///
/// O(n^2) distances, of which only near pairs are looked at.
pub(crate) fn find_duplicates(map: &ObjectMap, config: &MergeConfig) -> Option<ObjectMerge> {
    for (place, one) in map.objects.iter().enumerate() {
        for other in &map.objects[place + 1..] {
            if is_one(map, one, other, config) {
                let other_goes = other.observations <= one.observations;
                let (kept, removed) = if other_goes { (one.id, other.id) } else { (other.id, one.id) };
                return Some(ObjectMerge { kept, removed });
            }
        }
    }
    None
}

fn is_one(map: &ObjectMap, one: &MapObject, other: &MapObject, config: &MergeConfig) -> bool {
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
        iou >= config.min_iou || inside >= config.min_inside
    } else {
        iou >= config.min_iou_other_label
    };
    let together = f64::from(map.together.get(&(one.id, other.id)).copied().unwrap_or(0));
    let fewer = f64::from(one.observations.min(other.observations));
    let solid_iou = if one.label == other.label { config.solid_iou } else { config.solid_iou_other_label };
    let is_solid = iou >= solid_iou;
    is_solid || (overlaps && together <= config.max_together * fewer)
}

mod report;
mod yaw;

use dymlm_core::Pose;
use dymlm_core::vector3::{difference, dot};
use dymlm_geometry::OrientedBox;
pub use report::{Demand, DuplicateObject, LabelVerdict, ObjectMatch, ObjectScore};
use yaw::yaw_error_degrees;

use crate::Spread;
use crate::TrueObject;
use crate::assignment::{ONE, assign};

/// An object of a map to be scored, as `objects.json` holds it.
///
/// An object with invalid dimensions (negative, not finite) counts as an estimate that matches nothing.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EstimatedObject {
    /// COCO label.
    pub label: String,
    /// Pose of the object's frame: origin at the centre, axes along the sides.
    pub world_from_object: Pose,
    /// Full lengths along its axes, metres; of an ellipsoid, its diameters.
    pub dimensions: [f64; 3],
}

/// Scores the objects of a map against the true ones. Both are compared as boxes, with exact volumes.
///
/// - **Match**: estimates and true objects are paired one to one, so that the sum of their intersections over
///   unions is greatest, among pairs of at least 0.25, the threshold of the `ScanNet` and SUN RGB-D
///   benchmarks. Labels are not considered.
/// - **Asked for** are objects that at least 8 frames saw. A match with another object counts as correct in
///   all figures except recall.
/// - **Recall** = objects asked for with a match / objects asked for. **Precision** = estimates with a match
///   / estimates. **Label accuracy** = matches with the right label / matches.
/// - **Duplicates**: estimates without a match that reach 0.25 with a matched object, or whose centre is in
///   its box. They also reduce precision.
/// - **Mean `IoU`** of the matches' boxes, oriented, in 3D. **Centre error**: distance between the centres.
/// - **Yaw error**: angle about the true box's z axis (the vertical) between the longer horizontal axes of
///   the two boxes, modulo half a turn; for a square footprint between any horizontal axes, modulo a quarter
///   turn; for a round object there is none. The estimate's horizontal axes are the two furthest from the
///   vertical, in whatever order the estimate has its axes.
///
/// O(n m) overlaps of some microseconds each, and O((n + m)^3) for the assignment.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_geometry::OrientedBox;
/// use dymlm_metrics::{EstimatedObject, TrueObject, score_objects};
///
/// let tv = TrueObject::new(4, "tv", OrientedBox::new(Pose::identity(), [0.5, 0.1, 0.4])?, 20);
/// let estimate = EstimatedObject {
///     label: "tv".to_owned(),
///     world_from_object: Pose::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?,
///     dimensions: [0.5, 0.1, 0.4],
/// };
/// let score = score_objects(&[estimate], &[tv]);
/// assert_eq!((score.recall(), score.precision(), score.label_accuracy()), (Some(1.0), Some(1.0), Some(1.0)));
/// assert!((score.mean_iou.ok_or("no match")? - 0.4 / 0.6).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn score_objects(estimates: &[EstimatedObject], objects: &[TrueObject]) -> ObjectScore {
    let boxes: Vec<Option<OrientedBox>> = estimates
        .iter()
        .map(|estimate| OrientedBox::new(estimate.world_from_object, estimate.dimensions).ok())
        .collect();
    let iou: Vec<f64> = boxes
        .iter()
        .flat_map(|own| objects.iter().map(|object| own.map_or(0.0, |own| own.iou(&object.oriented_box))))
        .collect();
    let iou_of = |(estimate, object): (usize, usize)| iou[estimate * objects.len() + object];
    let weight = |pair| if iou_of(pair) >= MIN_IOU { (iou_of(pair) * ONE as f64) as i64 } else { 0 };
    let pairs = assign(estimates.len(), objects.len(), |estimate, object| weight((estimate, object)));
    let matches: Vec<ObjectMatch> = pairs
        .iter()
        .filter_map(|&(estimate, object)| {
            let same_label = estimates[estimate].label == objects[object].label;
            let label = if same_label { LabelVerdict::Right } else { LabelVerdict::Wrong };
            let (own, iou) = (boxes[estimate]?, iou_of((estimate, object)));
            Some(compare(estimate, &own, &objects[object], iou, label))
        })
        .collect();

    let asked = || objects.iter().filter(|object| object.frames_visible >= MIN_FRAMES);
    let mut missed: Vec<usize> = asked()
        .map(|object| object.id)
        .filter(|&id| !matches.iter().any(|found| found.object == id))
        .collect();
    missed.sort_unstable();
    let matched = |index: &usize| matches.iter().any(|found| found.estimate == *index);
    let unmatched: Vec<usize> = (0..estimates.len()).filter(|index| !matched(index)).collect();
    ObjectScore {
        estimates: estimates.len(),
        asked: asked().count(),
        missed,
        duplicates: find_duplicates(&unmatched, &boxes, objects, &pairs, &iou),
        unmatched,
        mean_iou: mean(matches.iter().map(|found| found.iou)),
        center_error: Spread::of(matches.iter().map(|found| found.center_error).collect()),
        yaw_error_degrees: Spread::of(matches.iter().filter_map(|found| found.yaw_error_degrees).collect()),
        matches,
    }
}

/// Least intersection over union of the boxes' volumes for a match.
const MIN_IOU: f64 = 0.25;
/// Number of frames that must have seen an object before a map is asked for it.
const MIN_FRAMES: u32 = 8;

/// The figures of a match.
fn compare(
    estimate: usize,
    own: &OrientedBox,
    object: &TrueObject,
    iou: f64,
    label: LabelVerdict,
) -> ObjectMatch {
    let offset = difference(own.center(), object.oriented_box.center());
    let asked = object.frames_visible >= MIN_FRAMES;
    ObjectMatch {
        estimate,
        object: object.id,
        demand: if asked { Demand::Asked } else { Demand::Optional },
        iou,
        center_error: dot(offset, offset).sqrt(),
        yaw_error_degrees: yaw_error_degrees(own, &object.oriented_box, object.symmetry),
        label,
    }
}

/// Estimates without a match at the place of a matched object, and the estimate that matches it.
fn find_duplicates(
    unmatched: &[usize],
    boxes: &[Option<OrientedBox>],
    objects: &[TrueObject],
    pairs: &[(usize, usize)],
    iou: &[f64],
) -> Vec<DuplicateObject> {
    let duplicate = |&estimate: &usize| {
        let own = boxes[estimate]?;
        let overlap = |object: usize| iou[estimate * objects.len() + object];
        let same_place =
            |object: usize| overlap(object) >= MIN_IOU || objects[object].oriented_box.contains(own.center());
        let nearest = pairs
            .iter()
            .filter(|&&(_, object)| same_place(object))
            .max_by(|a, b| overlap(a.1).total_cmp(&overlap(b.1)).then(b.0.cmp(&a.0)));
        nearest.map(|&(of, _)| DuplicateObject { estimate, of })
    };
    unmatched.iter().filter_map(duplicate).collect()
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let count = values.clone().count();
    (count > 0).then(|| values.sum::<f64>() / count as f64)
}

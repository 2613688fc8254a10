use dymlm_core::Pose;
use dymlm_geometry::OrientedBox;

use crate::vector3::{Vector3, along, dot};
use crate::{Footprint, SizePrior};

/// Grows a box away from the cameras to the size that such a thing usually has, along the axis that they look along: the
/// far side was not seen. A thing with an even footprint is as deep as it is wide. What was measured is never shortened.
///
/// `view` is the mean direction from the cameras; with an `upright` box the third axis is vertical and stays as it is.
pub(super) fn complete(own: &OrientedBox, prior: &SizePrior, view: Vector3, upright: bool) -> OrientedBox {
    let axes = axes_of(own);
    let lengths = own.lengths();
    let candidates = if upright { 2 } else { 3 };
    let toward = |axis: usize| dot(axes[axis], view).abs();
    let Some(depth_axis) = (0..candidates).reduce(|a, b| if toward(b) > toward(a) { b } else { a }) else {
        return *own;
    };
    let across = if upright { 1 - depth_axis } else { longer_of_others(lengths, depth_axis) };
    let usual = usual_depth(prior, lengths[across]);
    let missing = usual - lengths[depth_axis];
    if missing <= 0.0 {
        return *own;
    }
    let away = if dot(axes[depth_axis], view) < 0.0 { -0.5 * missing } else { 0.5 * missing };
    let center = along(own.center(), away, axes[depth_axis]);
    let mut grown = lengths;
    grown[depth_axis] = usual;
    let pose = Pose::new(center, own.world_from_box().quaternion()).ok();
    pose.and_then(|pose| OrientedBox::new(pose, grown).ok()).unwrap_or(*own)
}

/// How deep a thing is that is so wide.
fn usual_depth(prior: &SizePrior, across: f64) -> f64 {
    let far_from = |usual: f64| (across / usual).ln().abs();
    match prior.footprint {
        Footprint::Even => across.clamp(prior.width.min, prior.length.max),
        Footprint::Oblong if far_from(prior.length.typical) <= far_from(prior.width.typical) => prior.width.typical,
        Footprint::Oblong => prior.length.typical,
    }
}

fn longer_of_others(lengths: [f64; 3], axis: usize) -> usize {
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    if lengths[b] > lengths[a] { b } else { a }
}

fn axes_of(own: &OrientedBox) -> [Vector3; 3] {
    let rows = own.world_from_box().rotation_matrix();
    [0, 1, 2].map(|axis| rows.map(|row| row[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SizePriors;

    fn box_of(lengths: [f64; 3]) -> OrientedBox {
        OrientedBox::new(Pose::identity(), lengths).unwrap()
    }

    #[test]
    fn the_far_side_of_a_round_thing_is_as_far_as_it_is_wide() {
        let priors = SizePriors::default();
        let cup = priors.of("cup").unwrap();
        let seen = box_of([0.09, 0.04, 0.1]);
        let completed = complete(&seen, cup, [0.1, 0.9, -0.3], true);
        assert_eq!(completed.lengths(), [0.09, 0.09, 0.1]);
        assert!((completed.center()[1] - 0.025).abs() < 1e-12);
        // The near side stays where it is.
        assert!((completed.center()[1] - 0.045 + 0.02).abs() < 1e-12);
        let from_behind = complete(&seen, cup, [0.1, -0.9, -0.3], true);
        assert!((from_behind.center()[1] + 0.025).abs() < 1e-12);
    }

    #[test]
    fn what_was_measured_is_kept() {
        let priors = SizePriors::default();
        let keyboard = priors.of("keyboard").unwrap();
        let seen = box_of([0.44, 0.16, 0.03]);
        assert_eq!(complete(&seen, keyboard, [0.0, 1.0, 0.0], true), seen);
    }
}

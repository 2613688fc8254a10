use dymlm_core::vector3::{Vector3, along, difference, dot, unit};
use dymlm_core::{Plane, Pose};
use dymlm_geometry::OrientedBox;

use crate::object_map::{KeyView, KeyViews};
use crate::{Footprint, SideView, SizePrior};

/// Extends a box where no camera has seen the object's end, to the usual size of things of its label: away
/// from the cameras, and on sides that something occludes in most of the views. Measured lengths are never
/// shortened, an `upright` box keeps its height, and no box grows through a wall in front of which it stands.
///
/// A thing with an even footprint is assumed to be as deep as it is wide. For an oblong one the side that
/// fits better is taken as its length. The foot of a plate reaches as far before it as behind.
pub(super) fn complete(
    own: &OrientedBox,
    prior: &SizePrior,
    views: &KeyViews,
    upright: bool,
    walls: &[Plane],
) -> OrientedBox {
    let Some(mean_view) = mean_view(own, views) else { return *own };
    let axes = axes_of(own);
    let lengths = own.lengths();
    let toward = |axis: usize| dot(axes[axis], mean_view).abs();
    let candidates = if upright { 2 } else { 3 };
    // A plate's depth is its thin axis, from wherever it is seen; the depth of other things is the axis along
    // the view.
    let is_plate = upright && prior.footprint == Footprint::Plate;
    let rank = |axis: usize| if is_plate { -lengths[axis] } else { toward(axis) };
    let Some(depth) = (0..candidates).reduce(|a, b| if rank(b) > rank(a) { b } else { a }) else {
        return *own;
    };
    let across = if upright { 1 - depth } else { longer_of_others(lengths, depth) };

    let sides = [-1.0, 1.0].map(|side| side * if dot(axes[across], mean_view) < 0.0 { -1.0 } else { 1.0 });
    let hidden = sides.map(|side| is_hidden(axes[across].map(|c| side * c), views));
    let usual = usual_lengths(prior, lengths[across], lengths[depth], hidden.contains(&true));

    let mut grown = *own;
    if hidden.contains(&true) {
        let shares = [0, 1].map(|side| if hidden[side] { 1.0 } else { 0.0 });
        grown = widen(&grown, across, sides, shares, usual.across, walls);
    }
    let away = if dot(axes[depth], mean_view) < 0.0 { -1.0 } else { 1.0 };
    let shares = if prior.footprint == Footprint::Plate { [1.0, 1.0] } else { [0.0, 1.0] };
    widen(&grown, depth, [-away, away], shares, usual.depth, walls)
}

/// Extends an upright box down to the usual height when views do not show its lower end. For boxes without a
/// known plane under them.
pub(super) fn complete_foot(own: &OrientedBox, prior: &SizePrior, views: &KeyViews) -> OrientedBox {
    let up = axes_of(own)[2];
    if is_hidden(up.map(|c| -c), views) {
        widen(own, 2, [-1.0, 1.0], [1.0, 0.0], prior.height.typical, &[])
    } else {
        *own
    }
}

struct UsualLengths {
    across: f64,
    depth: f64,
}

/// Usual width and depth of a thing of this kind, given its measured lengths.
fn usual_lengths(prior: &SizePrior, across: f64, depth: f64, is_cut: bool) -> UsualLengths {
    let (length, width) = (prior.length.typical, prior.width.typical);
    if prior.footprint == Footprint::Even {
        // The measured width says little when a side is occluded.
        let usual = (length * width).sqrt();
        let side = if is_cut { across.max(usual) } else { (across * usual).sqrt() };
        let side = side.clamp(prior.width.min, prior.length.max);
        return UsualLengths { across: side, depth: side };
    }
    let misfit = |usual_across: f64, usual_depth: f64| {
        let (wide, deep) = ((across / usual_across).ln(), (depth.max(1e-3) / usual_depth).ln().abs());
        let wide = if is_cut { wide.max(0.0) } else { wide.abs() };
        wide + deep
    };
    if misfit(length, width) <= misfit(width, length) {
        UsualLengths { across: length, depth: width }
    } else {
        UsualLengths { across: width, depth: length }
    }
}

/// Moves the ends of an axis outwards until it has a given `length`, each by its share of what is missing, or
/// up to a wall; unchanged when nothing is missing.
fn widen(
    own: &OrientedBox,
    axis: usize,
    sides: [f64; 2],
    shares: [f64; 2],
    length: f64,
    walls: &[Plane],
) -> OrientedBox {
    let mut lengths = own.lengths();
    let missing = length - lengths[axis];
    let whole = shares[0] + shares[1];
    if !(missing > 0.0 && whole > 0.0) {
        return *own;
    }
    let growth = [0, 1].map(|end| {
        let wanted = missing * shares[end] / whole;
        wanted.min(room_before(own, axis, sides[end], walls))
    });
    let shift = 0.5 * (sides[0] * growth[0] + sides[1] * growth[1]);
    let center = along(own.center(), shift, axes_of(own)[axis]);
    lengths[axis] += growth[0] + growth[1];
    let pose = Pose::new(center, own.world_from_box().quaternion()).ok();
    pose.and_then(|pose| OrientedBox::new(pose, lengths).ok()).unwrap_or(*own)
}

/// How far one end of an axis may move before a corner meets a wall that faces it. Only walls with the whole
/// box in front of them count, because the object's own faces are planes of the map too.
fn room_before(own: &OrientedBox, axis: usize, side: f64, walls: &[Plane]) -> f64 {
    let axes = axes_of(own);
    let faces = |wall: &&Plane| {
        let cosines = axes.map(|own| dot(wall.normal(), own));
        side * cosines[axis] < 0.0 && cosines.iter().all(|cosine| cosine.abs() <= cosines[axis].abs())
    };
    let room = |wall: &Plane| {
        let corners = own.corners().map(|corner| wall.signed_distance(corner));
        let nearest = corners.into_iter().fold(f64::INFINITY, f64::min);
        nearest / dot(wall.normal(), axes[axis]).abs()
    };
    let rooms = walls.iter().filter(faces).map(room);
    rooms.filter(|&room| room > 0.0).fold(f64::INFINITY, f64::min)
}

/// Whether something occludes the object's end in a direction (world) in most of the views that show this end
/// sideways.
fn is_hidden(direction: Vector3, views: &KeyViews) -> bool {
    let sides = views.iter().filter_map(|view| side_toward(direction, view));
    let (hidden, all) =
        sides.fold((0, 0), |(hidden, all), side| (hidden + u32::from(side != SideView::Whole), all + 1));
    all > 0 && 2 * hidden >= all
}

/// What cuts the view off on the side of the image to which a direction points; `None` when it points mostly
/// along the view.
fn side_toward(direction: Vector3, view: &KeyView) -> Option<SideView> {
    view.completeness.toward(view.world_from_camera.inverse().rotate(direction))
}

/// Mean direction from the cameras of the views to a box.
fn mean_view(own: &OrientedBox, views: &KeyViews) -> Option<Vector3> {
    let rays =
        views.iter().filter_map(|view| unit(difference(own.center(), view.world_from_camera.translation())));
    unit(rays.fold([0.0; 3], |sum, ray| along(sum, 1.0, ray)))
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
    use dymlm_core::{BoundingBox, PinholeCamera};

    use super::*;
    use crate::{Completeness, SizePriors};

    fn box_of(lengths: [f64; 3]) -> OrientedBox {
        OrientedBox::new(Pose::identity(), lengths).unwrap()
    }

    /// The camera is 2 m before the origin and looks along y, z up.
    fn views(completeness: Completeness) -> KeyViews {
        let rows = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        let mut views = KeyViews::default();
        let view = KeyView {
            camera: PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0).unwrap(),
            world_from_camera: Pose::from_rotation_matrix(rows, [0.0, -2.0, 0.0]).unwrap(),
            bounding_box: BoundingBox::new(300.0, 200.0, 340.0, 260.0).unwrap(),
            completeness,
        };
        views.add(view, 1);
        views
    }

    #[test]
    fn the_far_side_of_a_round_thing_is_as_far_as_it_is_wide() {
        let priors = SizePriors::default();
        let bowl = priors.of("bowl").unwrap();
        let completed =
            complete(&box_of([0.16, 0.06, 0.1]), bowl, &views(Completeness::default()), true, &[]);
        assert_eq!(completed.lengths()[0], 0.16);
        assert!((completed.lengths()[1] - 0.16).abs() < 1e-12);
        // The near side stays where it is.
        assert!((completed.center()[1] - 0.08 + 0.03).abs() < 1e-12);
    }

    #[test]
    fn a_hidden_end_is_completed_and_a_seen_one_is_kept() {
        let priors = SizePriors::default();
        let keyboard = priors.of("keyboard").unwrap();
        let seen = box_of([0.24, 0.15, 0.03]);
        assert_eq!(complete(&seen, keyboard, &views(Completeness::default()), true, &[]), seen);
        let hidden = views(Completeness { right: SideView::Occluder, ..Completeness::default() });
        let completed = complete(&seen, keyboard, &hidden, true, &[]);
        assert_eq!(completed.lengths(), [0.44, 0.15, 0.03]);
        assert!((completed.center()[0] - 0.1).abs() < 1e-12 && completed.center()[1].abs() < 1e-12);
    }

    #[test]
    fn the_foot_of_a_monitor_is_on_both_sides() {
        let priors = SizePriors::default();
        let tv = priors.of("tv").unwrap();
        let completed = complete(&box_of([0.54, 0.04, 0.45]), tv, &views(Completeness::default()), true, &[]);
        assert_eq!(completed.lengths(), [0.54, 0.18, 0.45]);
        assert_eq!(completed.center(), [0.0; 3]);
    }

    #[test]
    fn nothing_grows_through_a_wall() {
        let priors = SizePriors::default();
        let (chair, own) = (priors.of("chair").unwrap(), box_of([0.5, 0.2, 0.9]));
        let depth = |walls: &[Plane]| {
            let completed = complete(&own, chair, &views(Completeness::default()), true, walls);
            (completed.lengths()[1], completed.center()[1] + 0.5 * completed.lengths()[1])
        };
        assert!(depth(&[]).0 > 0.45);
        let behind = Plane::new([0.0, -1.0, 0.0], 0.25).unwrap();
        let own_front = Plane::new([0.0, -1.0, 0.0], -0.1).unwrap();
        let floor = Plane::new([0.0, 0.01, 1.0], 0.46).unwrap();
        assert!((depth(&[behind]).1 - 0.25).abs() < 1e-9);
        assert_eq!(depth(&[own_front, floor]), depth(&[]));
    }
}

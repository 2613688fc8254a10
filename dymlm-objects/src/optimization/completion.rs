use dymlm_core::vector3::{Vector3, along, difference, dot, unit};
use dymlm_core::{Plane, Pose};
use dymlm_geometry::OrientedBox;

use super::reparameterizer::MAX_IOU_LOSS;
use crate::object_map::{KeyView, KeyViews};
use crate::parameterization::ALONG_VIEW;
use crate::{Footprint, ObjectShape, ShapeKind, SideView, SizePrior};

/// What is known of how a box stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stance {
    /// Its third axis is vertical, and it reaches down to the plane that it stands on.
    OnPlane,
    /// Its third axis is vertical.
    Upright,
    Unknown,
}

/// How a box is completed: to the usual size of things of its label, as far as the views allow.
pub(super) struct Completion<'a> {
    pub(super) prior: &'a SizePrior,
    pub(super) views: &'a KeyViews,
    pub(super) stance: Stance,
    /// Whether parts of it may lie on the plane without showing in depth.
    pub(super) has_flat_parts: bool,
    /// Planes near the box, in the world.
    pub(super) walls: &'a [Plane],
}

impl Completion<'_> {
    /// Extends a box where no camera has seen the object's end: away from the cameras, and on sides that
    /// something occludes in most of the views. Where the views' boxes show that the thing goes on without
    /// readings, as above the keys of a laptop with a dark screen, or flat on its plane before the lid, the box
    /// grows there. Measured lengths are
    /// never shortened, and no box grows through a wall in front of which it stands.
    ///
    /// A thing with an even footprint is assumed to be as deep as it is wide, which depends on its
    /// [height](Self::width_scale). For an oblong one the side that fits better is taken as its length.
    pub(super) fn complete(&self, own: &OrientedBox) -> OrientedBox {
        let is_upright = self.stance != Stance::Unknown;
        if is_upright && self.prior.footprint == Footprint::Plate {
            return self.complete_plate(own);
        }
        let completed = self.complete_sides(own);
        let completed = if is_upright { self.complete_height(&completed) } else { completed };
        if self.stance == Stance::Upright { self.complete_foot(&completed) } else { completed }
    }

    /// Extends the box along the view and across it.
    fn complete_sides(&self, own: &OrientedBox) -> OrientedBox {
        let Some(mean_view) = mean_view(own, self.views) else { return *own };
        let (axes, lengths) = (axes_of(own), own.lengths());
        let toward = |axis: usize| dot(axes[axis], mean_view).abs();
        let is_upright = self.stance != Stance::Unknown;
        let candidates = if is_upright { 2 } else { 3 };
        let Some(depth) = (0..candidates).reduce(|a, b| if toward(b) > toward(a) { b } else { a }) else {
            return *own;
        };
        let across = if is_upright { 1 - depth } else { longer_of_others(lengths, depth) };

        let hidden = hidden_ends(own, across, self.views);
        let scale = if is_upright { self.width_scale(own) } else { 1.0 };
        let measured = [lengths[across], lengths[depth]];
        let usual = usual_lengths(self.prior, scale, measured, hidden.contains(&true));
        let grown = widen(own, across, hidden, usual.across, self.walls);
        let is_away = dot(axes[depth], mean_view) > 0.0;
        let away = |own: &OrientedBox| widen(own, depth, [!is_away, is_away], usual.depth, self.walls);
        let wide = if self.has_flat_parts {
            let aside = |ends: [bool; 2]| widen(&grown, across, ends, usual.across, self.walls);
            self.better(self.better(grown, aside([true, false])), aside([false, true]))
        } else {
            grown
        };
        // What is higher everywhere than what hides its foot would have been seen before it.
        let is_foot_hidden = is_upright && is_hidden(own, axes[2].map(|c| -c), self.views);
        if !(self.has_flat_parts || is_foot_hidden) {
            return away(&wide);
        }
        let near = widen(&wide, depth, [is_away, !is_away], usual.depth, self.walls);
        self.better(away(&wide), near)
    }

    /// Extends the box up to the usual height, if the views' boxes show that.
    pub(super) fn complete_height(&self, own: &OrientedBox) -> OrientedBox {
        let higher = widen(own, 2, [false, true], self.prior.height.typical, self.walls);
        self.better(*own, higher)
    }

    /// The usual of two boxes, or the other one, if that fits the views' boxes better than by the detector's
    /// jitter. Both are compared as cuboids, which reach as far as any thing in them: an ellipsoid of the true
    /// size fits worse than one that is too large if the thing has corners.
    fn better(&self, usual: OrientedBox, other: OrientedBox) -> OrientedBox {
        let cuboid = |own| ObjectShape::new(ShapeKind::Cuboid, own);
        let fit = |own| self.views.mean_iou(&cuboid(own)).unwrap_or(0.0);
        if usual != other && fit(other) > fit(usual) + MAX_IOU_LOSS { other } else { usual }
    }

    /// The same for an upright plate, a screen: its foot reaches as far before it as behind, and its length
    /// may be along the view.
    fn complete_plate(&self, own: &OrientedBox) -> OrientedBox {
        let Self { prior, views, walls, .. } = *self;
        let lengths = own.lengths();
        let hidden = [0, 1].map(|axis| hidden_ends(own, axis, views));
        let misfit =
            |axis: usize, usual: f64| misfit(lengths[axis].max(1e-3), usual, hidden[axis].contains(&true));
        let (length, width) = (prior.length.typical, prior.width.typical);
        let longer = usize::from(lengths[1] > lengths[0]);
        let is_longer_the_length = misfit(longer, length) + misfit(1 - longer, width)
            <= misfit(1 - longer, length) + misfit(longer, width);
        let along = if is_longer_the_length { longer } else { 1 - longer };
        let grown = widen(own, along, hidden[along], length, walls);
        let grown = widen(&grown, 1 - along, [true; 2], width, walls);
        if self.stance == Stance::Upright { self.complete_foot(&grown) } else { grown }
    }

    /// Extends an upright box down to the usual height, or to the floor, when views do not show its lower end.
    /// For boxes of which it is not known what they stand on.
    fn complete_foot(&self, own: &OrientedBox) -> OrientedBox {
        let up = axes_of(own)[2];
        let is_foot_hidden = is_hidden(own, up.map(|c| -c), self.views);
        widen(own, 2, [is_foot_hidden, false], self.prior.height.typical, self.walls)
    }

    /// How many times as wide as usual an upright thing of its height may be expected to be; of a thing that is
    /// not seen to both its ends, not less than 1. Large things of a kind are slenderer than small ones, and
    /// some differ in height alone, so that the width grows with the root of the height.
    fn width_scale(&self, own: &OrientedBox) -> f64 {
        let scale = (own.lengths()[2] / self.prior.height.typical).sqrt();
        let [is_foot_hidden, is_top_hidden] = hidden_ends(own, 2, self.views);
        let is_whole = !is_top_hidden && (self.stance == Stance::OnPlane || !is_foot_hidden);
        if is_whole { scale } else { scale.max(1.0) }
    }
}

struct UsualLengths {
    across: f64,
    depth: f64,
}

/// Usual width and depth of a thing of this kind that is `scale` times as wide as usual, given its measured
/// lengths.
fn usual_lengths(prior: &SizePrior, scale: f64, [across, depth]: [f64; 2], is_cut: bool) -> UsualLengths {
    let (length, width) = (prior.length.typical, prior.width.typical);
    if prior.footprint == Footprint::Even {
        // The measured width says little when a side is occluded.
        let usual = scale * (length * width).sqrt();
        let side = if is_cut { across.max(usual) } else { (across * usual).sqrt() };
        let side = side.clamp(prior.width.min, prior.length.max);
        return UsualLengths { across: side, depth: side };
    }
    let misfit = |usual_across: f64, usual_depth: f64| {
        misfit(across, usual_across, is_cut) + misfit(depth.max(1e-3), usual_depth, false)
    };
    if misfit(length, width) <= misfit(width, length) {
        UsualLengths { across: length, depth: width }
    } else {
        UsualLengths { across: width, depth: length }
    }
}

/// How far a measured length is from the usual one, as the logarithm of their ratio. A length of which an end
/// is hidden may be shorter than the thing.
fn misfit(measured: f64, usual: f64, is_cut: bool) -> f64 {
    let excess = (measured / usual).ln();
    if is_cut { excess.max(0.0) } else { excess.abs() }
}

/// Moves the chosen ends of an axis, the one of low coordinates first, outwards until it has a given
/// `length`, each by its share of what is missing, or up to a wall; unchanged when nothing is missing or no
/// end is chosen.
fn widen(own: &OrientedBox, axis: usize, ends: [bool; 2], length: f64, walls: &[Plane]) -> OrientedBox {
    let mut lengths = own.lengths();
    let missing = length - lengths[axis];
    let count = ends.iter().filter(|&&moves| moves).count();
    if !(missing > 0.0 && count > 0) {
        return *own;
    }
    let growth = [(ends[0], -1.0), (ends[1], 1.0)].map(|(moves, side)| {
        let wanted = if moves { missing / count as f64 } else { 0.0 };
        wanted.min(room_before(own, axis, side, walls))
    });
    let shift = 0.5 * (growth[1] - growth[0]);
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

/// Whether the views hide the ends of an axis, the one of low coordinates first.
fn hidden_ends(own: &OrientedBox, axis: usize, views: &KeyViews) -> [bool; 2] {
    let direction = axes_of(own)[axis];
    [-1.0, 1.0].map(|side| is_hidden(own, direction.map(|c| side * c), views))
}

/// Whether most of the views do not show the object's end in a direction (world): something occludes it, or
/// it is the far end of a thing seen along that direction, a screen seen from its edge.
fn is_hidden(own: &OrientedBox, direction: Vector3, views: &KeyViews) -> bool {
    let hides = |view: &KeyView| {
        let ray = unit(difference(own.center(), view.world_from_camera.translation()))?;
        let away = dot(direction, ray);
        if away.abs() > ALONG_VIEW {
            return Some(away > 0.0);
        }
        let direction = view.world_from_camera.inverse().rotate(direction);
        let side = view.completeness.toward(direction, &view.camera)?;
        Some(side != SideView::Whole)
    };
    let (hidden, all) = views
        .iter()
        .filter_map(hides)
        .fold((0, 0), |(hidden, all), is_hidden| (hidden + u32::from(is_hidden), all + 1));
    all > 0 && 2 * hidden >= all
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
    use dymlm_core::PinholeCamera;

    use super::*;
    use crate::{Completeness, SizePriors};

    fn box_of(lengths: [f64; 3]) -> OrientedBox {
        box_at([0.0; 3], lengths)
    }

    fn box_at(center: Vector3, lengths: [f64; 3]) -> OrientedBox {
        OrientedBox::new(Pose::new(center, [0.0, 0.0, 0.0, 1.0]).unwrap(), lengths).unwrap()
    }

    /// A view in which the detector's box is around a thing. The camera is 2 m before the origin and looks
    /// along y, z up.
    fn views(shown: OrientedBox, completeness: Completeness) -> KeyViews {
        let rows = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        let camera = PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0).unwrap();
        let world_from_camera = Pose::from_rotation_matrix(rows, [0.0, -2.0, 0.0]).unwrap();
        let shape = ObjectShape::new(ShapeKind::Cuboid, shown);
        let bounding_box = shape.image_box(&camera, &world_from_camera).unwrap();
        let mut views = KeyViews::default();
        views.add(KeyView { camera, world_from_camera, bounding_box, completeness }, 1);
        views
    }

    /// A box on a plane, completed by a view that shows `shown`.
    fn complete(
        label: &str,
        own: OrientedBox,
        shown: OrientedBox,
        completeness: Completeness,
        walls: &[Plane],
    ) -> OrientedBox {
        let priors = SizePriors::default();
        let views = views(shown, completeness);
        let prior = priors.of(label).unwrap();
        let (stance, has_flat_parts) = (Stance::OnPlane, prior.height.min < 0.012);
        Completion { prior, views: &views, stance, has_flat_parts, walls }.complete(&own)
    }

    /// The same of a view that shows what was measured.
    fn complete_seen(label: &str, own: OrientedBox, completeness: Completeness) -> OrientedBox {
        complete(label, own, own, completeness, &[])
    }

    #[test]
    fn the_far_side_of_a_round_thing_is_as_far_as_it_is_wide() {
        let completed = complete_seen("bowl", box_of([0.16, 0.06, 0.08]), Completeness::default());
        assert_eq!(completed.lengths()[0], 0.16);
        assert!((completed.lengths()[1] - 0.16).abs() < 1e-12);
        // The near side stays where it is.
        assert!((completed.center()[1] - 0.08 + 0.03).abs() < 1e-12);
    }

    #[test]
    fn the_width_of_a_thing_depends_on_its_height() {
        let priors = SizePriors::default();
        let plant = priors.of("potted plant").unwrap();
        let half = box_of([0.19, 0.1, 0.5 * plant.height.typical]);
        let depth = |completeness: Completeness, stance: Stance| {
            let views = views(half, completeness);
            let completion =
                Completion { prior: plant, views: &views, stance, has_flat_parts: false, walls: &[] };
            completion.complete(&half).lengths()[1]
        };
        let seen = Completeness::default();
        let is = |depth: f64, usual: f64| (depth - usual).abs() < 1e-3;
        // Between the width that is seen and the usual one, .39 m, times the root of a half.
        let of_its_height = (0.19 * 0.39 * 0.5_f64.sqrt()).sqrt();
        assert!(is(depth(seen, Stance::OnPlane), of_its_height));
        let cut = Completeness { right: SideView::Occluder, ..seen };
        assert!(is(depth(cut, Stance::OnPlane), 0.39 * 0.5_f64.sqrt()));
        // Without its top or its foot, it may be as large as others.
        let of_usual_height = (0.19_f64 * 0.39).sqrt();
        let without_top = Completeness { top: SideView::Occluder, ..seen };
        assert!(is(depth(without_top, Stance::OnPlane), of_usual_height));
        let without_foot = Completeness { bottom: SideView::Occluder, ..seen };
        assert!(is(depth(without_foot, Stance::Upright), of_usual_height));
        assert!(is(depth(without_foot, Stance::OnPlane), of_its_height));
        // A tall one is wider, but less than it is higher.
        let tall = box_of([0.6, 0.6, 4.0 * plant.height.typical]);
        let views = views(tall, seen);
        let completion = Completion {
            prior: plant,
            views: &views,
            stance: Stance::OnPlane,
            has_flat_parts: false,
            walls: &[],
        };
        assert!((completion.width_scale(&tall) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_screen_without_readings_is_as_high_as_the_views_show() {
        let (base, whole) = (box_of([0.32, 0.25, 0.03]), box_at([0.0, 0.0, 0.095], [0.32, 0.25, 0.22]));
        let completed = complete("laptop", base, whole, Completeness::default(), &[]);
        assert!((completed.lengths()[2] - 0.22).abs() < 1e-12, "{:?}", completed.lengths());
        assert!((completed.center()[2] - 0.095).abs() < 1e-12);
        // Nothing rises from a laptop that is closed.
        assert_eq!(complete_seen("laptop", base, Completeness::default()).lengths()[2], 0.03);
    }

    #[test]
    fn what_is_too_flat_to_be_measured_lies_where_the_views_show_it() {
        let lid = box_of([0.34, 0.05, 0.2]);
        let depth =
            |shown: OrientedBox| complete("laptop", lid, shown, Completeness::default(), &[]).center()[1];
        assert!((depth(box_at([0.0, -0.1, 0.0], [0.34, 0.25, 0.2])) + 0.1).abs() < 1e-12);
        assert!((depth(lid) - 0.1).abs() < 1e-12, "otherwise it is hidden behind what is measured");
    }

    /// What is higher everywhere would have been seen.
    #[test]
    fn a_chair_grows_towards_no_camera() {
        let (back, whole) = (box_of([0.5, 0.05, 0.9]), box_at([0.0, -0.2, 0.0], [0.5, 0.45, 0.9]));
        let completed = complete("chair", back, whole, Completeness::default(), &[]);
        assert!(completed.center()[1] > 0.1, "{:?}", completed.center());
    }

    /// The seat may be under the table that hides the foot.
    #[test]
    fn a_chair_with_a_hidden_foot_lies_where_the_views_show_it() {
        let back = box_of([0.5, 0.05, 0.9]);
        let center = |shown: OrientedBox| {
            let hidden = Completeness { bottom: SideView::Occluder, ..Completeness::default() };
            complete("chair", back, shown, hidden, &[]).center()[1]
        };
        let nearer = center(box_at([0.0, -0.25, 0.0], [0.5, 0.55, 0.9]));
        let farther = center(box_at([0.0, 0.25, 0.0], [0.5, 0.55, 0.9]));
        assert!(nearer < -0.2 && farther > 0.2, "{nearer} {farther}");
    }

    #[test]
    fn what_is_too_flat_to_be_measured_may_lie_beside_what_is_seen() {
        // A lid seen along its length.
        let lid = box_of([0.05, 0.34, 0.2]);
        let whole = box_at([0.1, 0.0, 0.0], [0.25, 0.34, 0.2]);
        let completed = complete("laptop", lid, whole, Completeness::default(), &[]);
        assert!((completed.lengths()[0] - 0.25).abs() < 1e-12, "{:?}", completed.lengths());
        assert!((completed.center()[0] - 0.1).abs() < 1e-12);
        assert_eq!(complete_seen("laptop", lid, Completeness::default()), lid);
    }

    #[test]
    fn a_hidden_end_is_completed_and_a_seen_one_is_kept() {
        let seen = box_of([0.24, 0.15, 0.03]);
        assert_eq!(complete_seen("keyboard", seen, Completeness::default()), seen);
        let hidden = Completeness { right: SideView::Occluder, ..Completeness::default() };
        let completed = complete_seen("keyboard", seen, hidden);
        assert_eq!(completed.lengths(), [0.44, 0.15, 0.03]);
        assert!((completed.center()[0] - 0.1).abs() < 1e-12 && completed.center()[1].abs() < 1e-12);
    }

    #[test]
    fn the_foot_of_a_monitor_is_on_both_sides() {
        let completed = complete_seen("tv", box_of([0.54, 0.04, 0.45]), Completeness::default());
        assert_eq!(completed.lengths(), [0.54, 0.18, 0.45]);
        assert_eq!(completed.center(), [0.0; 3]);
    }

    #[test]
    fn a_screen_seen_from_its_edge_reaches_away_from_the_camera() {
        let completed = complete_seen("tv", box_of([0.05, 0.03, 0.45]), Completeness::default());
        assert!((completed.lengths()[1] - 0.56).abs() < 1e-12, "{:?}", completed.lengths());
        assert!((completed.lengths()[0] - 0.18).abs() < 1e-12);
        // The edge that was seen stays where it is.
        assert!((completed.center()[1] - 0.28 + 0.015).abs() < 1e-12 && completed.center()[0].abs() < 1e-12);
    }

    #[test]
    fn a_screen_of_which_a_strip_is_seen_reaches_behind_what_hides_it() {
        let hidden = Completeness { right: SideView::Occluder, ..Completeness::default() };
        let completed = complete_seen("tv", box_of([0.15, 0.04, 0.45]), hidden);
        assert_eq!(completed.lengths(), [0.56, 0.18, 0.45]);
        assert!((completed.center()[0] - 0.205).abs() < 1e-12 && completed.center()[1].abs() < 1e-12);
    }

    #[test]
    fn a_hidden_foot_reaches_down_to_the_floor() {
        let priors = SizePriors::default();
        let (chair, back) = (priors.of("chair").unwrap(), box_of([0.5, 0.5, 0.4]));
        let views = views(back, Completeness { bottom: SideView::Occluder, ..Completeness::default() });
        let lowest = |walls: &[Plane]| {
            let completion = Completion {
                prior: chair,
                views: &views,
                stance: Stance::Upright,
                has_flat_parts: false,
                walls,
            };
            let completed = completion.complete(&back);
            completed.center()[2] - 0.5 * completed.lengths()[2]
        };
        assert!((lowest(&[]) - 0.2 + 0.95).abs() < 1e-9);
        assert!((lowest(&[Plane::new([0.0, 0.0, 1.0], 0.5).unwrap()]) + 0.5).abs() < 1e-9);
    }

    #[test]
    fn nothing_grows_through_a_wall() {
        let own = box_of([0.5, 0.2, 0.9]);
        let depth = |walls: &[Plane]| {
            let completed = complete("chair", own, own, Completeness::default(), walls);
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

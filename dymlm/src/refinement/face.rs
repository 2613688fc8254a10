use dymlm_core::Pose;
use dymlm_core::vector3::{Vector3, along, cross, difference, dot, norm};
use dymlm_refine::PlaneView;

use super::odometry_drift::{OdometryDrift, REACH, quadratic};
use super::patch::Patch;

/// Most views of a visit that are compared with those of others, evenly chosen.
const COMPARED_VIEWS: usize = 12;
/// Slack of the quick test: how far the drift of the rotation may move a face sideways, as a share of the
/// distance.
const MOST_TILT: f64 = 0.2;
/// Least cosine between the normals of faces that may lie over each other: 60 degrees.
const LEAST_COSINE: f64 = 0.5;
/// Factor between the sizes of a plane that is seen twice, once from another side or in part: one standard
/// deviation.
const SIZE_FACTOR: f64 = 2.0;

/// What some key frames have seen of a plane, prepared for comparison with others.
pub(super) struct Face {
    /// The key frames that have seen it, ascending.
    key_frames: Vec<usize>,
    views: Vec<Patch>,
    middle: Vector3,
    /// Distance of what was seen of it from its middle, root mean square, metres.
    radius: f64,
    /// Greatest distance from its middle that a view with its radius reaches, metres.
    extent: f64,
}

impl Face {
    pub(super) fn new(views: &[PlaneView], poses: &[Pose]) -> Self {
        let key_frames = views.iter().map(|view| view.pose).collect();
        let step = views.len().div_ceil(COMPARED_VIEWS).max(1);
        let views: Vec<_> = views.iter().step_by(step).filter_map(|view| Patch::new(view, poses)).collect();
        let mean = |of: &dyn Fn(&Patch) -> f64| views.iter().map(of).sum::<f64>() / views.len() as f64;
        let middle = [0, 1, 2].map(|axis| mean(&|view| view.centroid[axis]));
        let off = |view: &Patch| norm(difference(view.centroid, middle));
        let radius = mean(&|view| view.radius.powi(2) + off(view).powi(2)).sqrt();
        let extent = views.iter().map(|view| view.radius + off(view)).fold(0.0, f64::max);
        Self { key_frames, views, middle, radius, extent }
    }

    /// Whether any of their views can lie over each other: a quick test, since most planes of a building
    /// cannot.
    pub(super) fn may_lie_over(&self, other: &Self) -> bool {
        let (Some(Patch { normal, .. }), Some(first)) = (self.views.first(), other.views.first()) else {
            return false;
        };
        if dot(*normal, first.normal) < LEAST_COSINE {
            return false;
        }
        let apart = difference(other.middle, self.middle);
        let within = along(apart, -dot(*normal, apart), *normal);
        norm(within) <= self.extent + other.extent + MOST_TILT * norm(apart)
    }

    /// Whether a key frame has seen both: then they are two planes.
    pub(super) fn was_seen_with(&self, other: &Self) -> bool {
        self.key_frames.iter().any(|key_frame| other.key_frames.binary_search(key_frame).is_ok())
    }

    /// How unlikely it is that two planes are one, by their distance along their normal and by their sizes,
    /// in squared standard deviations; and the view of each where they overlap most. `None` when these views
    /// do not overlap, or are further apart than poses can have drifted.
    pub(super) fn unlikeliness(&self, other: &Self, drift: &OdometryDrift) -> Option<(f64, [PlaneView; 2])> {
        let (gap, [a, b]) = self.nearest_views(other, Patch::faces_as)?;
        if gap >= 1.0 {
            return None;
        }
        let [first, last] = [a.view.pose.min(b.view.pose), a.view.pose.max(b.view.pose)];
        let distance = dot(a.normal, difference(b.centroid, a.centroid));
        let noise = 1.0 / a.view.information + 1.0 / b.view.information;
        let drift = drift.between(first..last, b.centroid);
        let variance = quadratic(&drift.translation, a.normal) + noise;
        let turn = norm(cross(a.normal, b.normal));
        let turn_variance = drift.rotation + noise / (a.radius * b.radius);
        let is_near = distance * distance <= REACH * REACH * variance;
        let is_turned = turn * turn > REACH * REACH * turn_variance;
        let size = (self.radius / other.radius).ln() / SIZE_FACTOR.ln();
        let unlikeliness = distance * distance / variance + size * size;
        (is_near && !is_turned).then_some((unlikeliness, [a.view, b.view]))
    }

    /// The view of each that are nearest to each other, whether they overlap or not.
    pub(super) fn joint(&self, other: &Self) -> Option<[PlaneView; 2]> {
        self.nearest_views(other, |_, _| true).map(|(_, patches)| patches.map(|patch| patch.view))
    }

    /// The gap between the nearest of the views that may be compared, and these.
    fn nearest_views<'a>(
        &'a self,
        other: &'a Self,
        are_comparable: impl Fn(&Patch, &Patch) -> bool,
    ) -> Option<(f64, [&'a Patch; 2])> {
        let pairs = self.views.iter().flat_map(|a| other.views.iter().map(move |b| [a, b]));
        let comparable = pairs.filter(|[a, b]| are_comparable(a, b)).map(|[a, b]| (a.gap(b), [a, b]));
        comparable.min_by(|one, other| one.0.total_cmp(&other.0))
    }
}

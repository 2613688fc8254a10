use dymlm_core::vector3::{Vector3, along, cross, difference, dot, norm};
use dymlm_core::{Pose, symmetric_eigen3};
use dymlm_refine::PlaneView;

use super::odometry_drift::{OdometryDrift, quadratic};

/// Most views of a plane that are compared with those of others, evenly chosen.
const COMPARED_VIEWS: usize = 12;
/// Greatest distance between two views of one plane, in standard deviations of the odometry between them.
pub(super) const REACH: f64 = 3.0;
/// Greatest angle between the normals of two views of one plane, radians: planes are associated below 10
/// degrees.
const MOST_TILT: f64 = 0.2;
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

/// What a view shows of a plane, in the world.
pub(super) struct Patch {
    pub(super) view: PlaneView,
    pub(super) centroid: Vector3,
    /// Toward the camera.
    pub(super) normal: Vector3,
    /// Distance of the inliers from their centroid within the plane, root mean square, metres.
    radius: f64,
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
        let Some(Patch { normal, .. }) = self.views.first() else { return false };
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
        let [a, b] = self.nearest_views(other, |a, b| a.faces_as(b) && a.gap(b) < 1.0)?;
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
        self.nearest_views(other, |_, _| true).map(|patches| patches.map(|patch| patch.view))
    }

    fn nearest_views<'a>(
        &'a self,
        other: &'a Self,
        are_comparable: impl Fn(&Patch, &Patch) -> bool,
    ) -> Option<[&'a Patch; 2]> {
        let pairs = self.views.iter().flat_map(|a| other.views.iter().map(move |b| [a, b]));
        pairs.filter(|[a, b]| are_comparable(a, b)).min_by(|[a, b], [c, d]| a.gap(b).total_cmp(&c.gap(d)))
    }
}

impl Patch {
    pub(super) fn new(view: &PlaneView, poses: &[Pose]) -> Option<Self> {
        let pose = poses.get(view.pose)?;
        let [xx, xy, xz, yy, yz, zz] = view.covariance;
        let eigen = symmetric_eigen3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])?;
        let normal = eigen.vectors[2];
        let faces_camera = dot(normal, view.centroid) < 0.0;
        let normal = if faces_camera { normal } else { normal.map(|c| -c) };
        Some(Self {
            view: *view,
            centroid: pose.transform_point(view.centroid),
            normal: pose.rotate(normal),
            radius: (eigen.values[0] + eigen.values[1]).max(0.0).sqrt(),
        })
    }

    /// Distance between two patches within their planes, in units of their radii: below 1 they lie over each
    /// other.
    fn gap(&self, other: &Self) -> f64 {
        let apart = difference(other.centroid, self.centroid);
        let within = along(apart, -dot(self.normal, apart), self.normal);
        norm(within) / (self.radius + other.radius)
    }

    fn faces_as(&self, other: &Self) -> bool {
        dot(self.normal, other.normal) > 0.0
    }
}

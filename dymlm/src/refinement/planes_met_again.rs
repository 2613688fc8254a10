use std::collections::BTreeMap;

use dymlm_core::vector3::{Vector3, along, cross, difference, dot, norm};
use dymlm_core::{PlaneId, Pose, symmetric_eigen3};
use dymlm_refine::PlaneView;

use super::odometry_drift::{OdometryDrift, quadratic};

/// Most views of a plane that are compared with those of others, evenly chosen.
const COMPARED_VIEWS: usize = 12;
/// Greatest distance between two views of one plane, in standard deviations of the odometry between them.
const REACH: f64 = 3.0;
/// Greatest angle between the normals of two views of one plane, radians: planes are associated below 10
/// degrees.
const MOST_TILT: f64 = 0.2;
/// Factor between the sizes of a plane that is seen twice, once from another side or in part: one standard
/// deviation.
const SIZE_FACTOR: f64 = 2.0;

/// Pairs of planes of the map that may be one plane, met again when the poses had drifted too far for the map
/// to join them. Each plane is paired with the likeliest plane that lies over it within the drift of the
/// odometry, unless one key frame has seen both. The likeliest is near, and of about the same size: where
/// heights have drifted, a floor comes to lie under a seat. A pair is given as one view of each plane, those
/// nearest to each other. Many pairs are wrong: they are for a solver that finds out which.
pub(super) fn planes_met_again(
    views: &BTreeMap<PlaneId, Vec<PlaneView>>,
    poses: &[Pose],
    drift: &OdometryDrift,
) -> Vec<[PlaneView; 2]> {
    let faces: Vec<Face> = views.values().map(|views| Face::new(views, poses)).collect();
    let mut pairs: Vec<([usize; 2], [PlaneView; 2])> = Vec::new();
    for (own, face) in faces.iter().enumerate() {
        let others = faces.iter().enumerate().filter(|(other, _)| *other != own);
        let over_it = others.filter(|(_, other)| face.may_lie_over(other) && !face.was_seen_with(other));
        let apart = over_it.filter_map(|(other, other_face)| {
            let (unlikeliness, pair) = face.nearest_views(other_face, drift)?;
            Some((unlikeliness, other, pair))
        });
        let Some((_, other, [a, b])) = apart.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        pairs.push(if own < other { ([own, other], [a, b]) } else { ([other, own], [b, a]) });
    }
    pairs.sort_by_key(|(planes, _)| *planes);
    pairs.dedup_by_key(|(planes, _)| *planes);
    pairs.into_iter().map(|(_, views)| views).collect()
}

/// A plane, prepared for comparison.
struct Face {
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
struct Patch {
    view: PlaneView,
    centroid: Vector3,
    /// Toward the camera.
    normal: Vector3,
    /// Distance of the inliers from their centroid within the plane, root mean square, metres.
    radius: f64,
}

impl Face {
    fn new(views: &[PlaneView], poses: &[Pose]) -> Self {
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
    fn may_lie_over(&self, other: &Self) -> bool {
        let Some(Patch { normal, .. }) = self.views.first() else { return false };
        let apart = difference(other.middle, self.middle);
        let within = along(apart, -dot(*normal, apart), *normal);
        norm(within) <= self.extent + other.extent + MOST_TILT * norm(apart)
    }

    /// Whether a key frame has seen both: then they are two planes.
    fn was_seen_with(&self, other: &Self) -> bool {
        self.key_frames.iter().any(|key_frame| other.key_frames.binary_search(key_frame).is_ok())
    }

    /// How unlikely it is that two planes are one, by their distance along their normal and by their sizes,
    /// in squared standard deviations; and the view of each where they overlap most. `None` when these views
    /// are further apart than poses can have drifted.
    fn nearest_views(&self, other: &Self, drift: &OdometryDrift) -> Option<(f64, [PlaneView; 2])> {
        let pairs = self.views.iter().flat_map(|a| other.views.iter().map(move |b| (a, b)));
        let overlapping = pairs.filter_map(|(a, b)| Some((a.gap(b)?, a, b)));
        let (_, a, b) = overlapping.min_by(|one, other| one.0.total_cmp(&other.0))?;
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
}

impl Patch {
    fn new(view: &PlaneView, poses: &[Pose]) -> Option<Self> {
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

    /// Distance between two patches within their planes, in units of their radii; `None` when they face
    /// different ways or do not lie over each other.
    fn gap(&self, other: &Self) -> Option<f64> {
        let apart = difference(other.centroid, self.centroid);
        let within = along(apart, -dot(self.normal, apart), self.normal);
        let gap = norm(within) / (self.radius + other.radius);
        (dot(self.normal, other.normal) > 0.0 && gap < 1.0).then_some(gap)
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{PlaneId, Pose};

    use super::*;

    /// Steps of 1 s with errors of 2 cm and .5 degrees: after 100 of them 20 cm and 5 degrees.
    const STEP: [f64; 2] = [0.0087, 0.02];

    /// What a key frame at the origin sees of a wall of 2 x 2 m: its distance, and how far to the right its
    /// centre is.
    fn view(pose: usize, ahead: f64, right: f64) -> PlaneView {
        let covariance = [1.0 / 3.0, 0.0, 0.0, 1.0 / 3.0, 0.0, 0.0];
        PlaneView { pose, information: 1e5, centroid: [right, 0.0, ahead], covariance }
    }

    fn pairs(first: &[PlaneView], second: &[PlaneView]) -> Vec<[usize; 2]> {
        pairs_of(&[first, second])
    }

    fn pairs_of(planes: &[&[PlaneView]]) -> Vec<[usize; 2]> {
        let poses = vec![Pose::identity(); 200];
        let drift = OdometryDrift::new(&poses, (0..199).map(|_| STEP));
        let views = planes.iter().zip(1..).map(|(views, id)| (PlaneId::new(id), views.to_vec()));
        let found = planes_met_again(&views.collect(), &poses, &drift);
        found.iter().map(|pair| pair.map(|view| view.pose)).collect()
    }

    #[test]
    fn a_wall_that_is_met_again_is_paired_within_what_odometry_drifts_by() {
        let wall = [view(0, 3.0, 0.0), view(1, 3.0, 0.0)];
        // The views are paired that overlap most.
        assert_eq!(pairs(&wall, &[view(101, 3.4, 0.5), view(102, 3.4, 0.1)]), [[0, 102]]);
        // After 10 s, 40 cm is too far: 3 times 6.3 cm, and what 1.6 degrees do to 3 m along the line of
        // sight.
        assert!(pairs(&wall, &[view(11, 3.4, 0.1)]).is_empty());
        assert_eq!(pairs(&wall, &[view(11, 3.15, 0.1)]), [[0, 11]]);
        // Walls beside each other are not paired; the order of the planes does not matter.
        assert!(pairs(&wall, &[view(102, 3.4, 2.0)]).is_empty());
        assert_eq!(pairs(&[view(102, 3.4, 0.1)], &wall), [[102, 0]]);
    }

    /// A floor that is met again 40 cm higher, where a seat was before, is no seat: floors are wide.
    #[test]
    fn what_is_met_again_is_of_its_size() {
        let narrow = |view: PlaneView| PlaneView { covariance: view.covariance.map(|c| 0.02 * c), ..view };
        let (floor, seat) = (view(0, 3.0, 0.0), narrow(view(3, 2.6, 0.0)));
        let (floor_again, seat_again) = (view(101, 2.6, 0.0), narrow(view(102, 2.2, 0.0)));
        let found = pairs_of(&[&[floor], &[seat], &[floor_again], &[seat_again]]);
        assert_eq!(found, [[0, 101], [3, 102]]);
    }

    #[test]
    fn planes_that_one_key_frame_has_seen_are_two() {
        let wall = [view(0, 3.0, 0.0), view(50, 3.0, 0.0)];
        assert!(pairs(&wall, &[view(50, 3.1, 0.0), view(102, 3.1, 0.0)]).is_empty());
        assert_eq!(pairs(&wall, &[view(51, 3.1, 0.0), view(102, 3.1, 0.0)]), [[0, 51]]);
        assert!(pairs(&wall, &[]).is_empty() && pairs(&[], &[]).is_empty());
    }
}

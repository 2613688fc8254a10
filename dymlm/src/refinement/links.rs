use dymlm_core::Pose;
use dymlm_refine::PlaneView;

use super::face::Face;
use super::odometry_drift::OdometryDrift;
use super::plane_visits::PlaneVisit;

/// Two visits that may be of one plane.
#[derive(Debug, Clone)]
pub(super) struct Link {
    /// Their places in the list of visits, ascending.
    pub(super) visits: [usize; 2],
    /// A view of each, those nearest to each other.
    pub(super) views: [PlaneView; 2],
}

impl Link {
    /// Whether both visits are to one plane of the map.
    pub(super) fn is_of_one_plane(&self, visits: &[PlaneVisit<'_>]) -> bool {
        let [one, other] = self.visits.map(|visit| visits[visit].plane);
        one == other
    }
}

/// Visits that may be of one plane: those to one plane of the map, each with the next, and each visit with the
/// likeliest other one, which may be of another plane of the map: the poses had drifted too far for it to join
/// them. Those to one plane of the map come first.
///
/// Many links are wrong; the solver finds out which.
pub(super) fn links_between(visits: &[PlaneVisit<'_>], poses: &[Pose], drift: &OdometryDrift) -> Vec<Link> {
    let faces: Vec<Face> = visits.iter().map(|visit| Face::new(visit.views, poses)).collect();
    let mut links = visits_in_turn(visits, &faces);
    links.extend(likeliest(&faces, drift));
    // Of equal links the first stays, which is the one in turn.
    links.sort_by_key(|link| (!link.is_of_one_plane(visits), link.visits));
    links.dedup_by_key(|link| link.visits);
    links
}

/// Each visit with the next one to the same plane of the map.
fn visits_in_turn(visits: &[PlaneVisit<'_>], faces: &[Face]) -> Vec<Link> {
    let in_turn = (1..visits.len()).filter(|&next| visits[next - 1].plane == visits[next].plane);
    let link = |next: usize| {
        let views = faces[next - 1].joint(&faces[next])?;
        Some(Link { visits: [next - 1, next], views })
    };
    in_turn.filter_map(link).collect()
}

/// Each visit with the likeliest one that lies over it within the drift of the odometry, unless one key frame
/// has seen both. The likeliest is near, and of about the same size: where heights have drifted, a floor comes
/// to lie under a seat.
fn likeliest(faces: &[Face], drift: &OdometryDrift) -> Vec<Link> {
    let of = |(own, face): (usize, &Face)| {
        let others = faces.iter().enumerate().filter(|(other, _)| *other != own);
        let over_it = others.filter(|(_, other)| face.may_lie_over(other) && !face.was_seen_with(other));
        let apart = over_it.filter_map(|(other, other_face)| {
            let (unlikeliness, views) = face.unlikeliness(other_face, drift)?;
            Some((unlikeliness, other, views))
        });
        let (_, other, [a, b]) = apart.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let in_order = Link { visits: [own, other], views: [a, b] };
        let reversed = Link { visits: [other, own], views: [b, a] };
        Some(if own < other { in_order } else { reversed })
    };
    faces.iter().enumerate().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use dymlm_core::PlaneId;

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
        let ids = (1..).map(PlaneId::new);
        let visits: Vec<PlaneVisit<'_>> =
            planes.iter().zip(ids).map(|(views, plane)| PlaneVisit { plane, views }).collect();
        links_between(&visits, &poses, &drift).iter().map(|link| link.views.map(|view| view.pose)).collect()
    }

    #[test]
    fn a_wall_that_is_met_again_is_linked_within_what_odometry_drifts_by() {
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
    fn visits_to_one_plane_of_the_map_are_linked_however_far_apart() {
        let visits = [
            (7, view(0, 3.0, 0.0)),
            (7, view(20, 3.0, 9.0)),
            (7, view(60, 3.0, 0.0)),
            (8, view(80, 1.0, 0.0)),
        ];
        let visits = visits
            .each_ref()
            .map(|(id, view)| PlaneVisit { plane: PlaneId::new(*id), views: std::slice::from_ref(view) });
        let poses = vec![Pose::identity(); 200];
        let drift = OdometryDrift::new(&poses, (0..199).map(|_| STEP));
        let found: Vec<[usize; 2]> =
            links_between(&visits, &poses, &drift).iter().map(|link| link.visits).collect();
        assert_eq!(found, [[0, 1], [0, 2], [1, 2]]);
    }

    #[test]
    fn planes_that_one_key_frame_has_seen_are_two() {
        let wall = [view(0, 3.0, 0.0), view(50, 3.0, 0.0)];
        assert!(pairs(&wall, &[view(50, 3.1, 0.0), view(102, 3.1, 0.0)]).is_empty());
        assert_eq!(pairs(&wall, &[view(51, 3.1, 0.0), view(102, 3.1, 0.0)]), [[0, 51]]);
        assert!(pairs(&wall, &[]).is_empty() && pairs(&[], &[]).is_empty());
    }
}

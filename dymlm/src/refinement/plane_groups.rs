use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{PlaneId, Pose};
use dymlm_refine::{Error, PlaneView, SolverConfig};

use super::links::Link;
use super::plane_visits::PlaneVisit;

/// Visits that turned out to be of one plane, together.
pub(super) struct PlaneGroups<'a> {
    visits: &'a [PlaneVisit<'a>],
    /// Within which the map associates planes, metres.
    max_distance: f64,
    /// For each visit an earlier one of its group; the first visit of a group has itself.
    earlier: Vec<usize>,
    /// The views of each group, by its first visit.
    views: BTreeMap<usize, Vec<PlaneView>>,
    /// Pairs of planes of the map that a link has joined.
    joined: BTreeSet<[PlaneId; 2]>,
}

impl<'a> PlaneGroups<'a> {
    /// Each visit a group of its own. `max_distance`: within which the map associates planes, metres.
    pub(super) fn new(visits: &'a [PlaneVisit<'a>], max_distance: f64) -> Self {
        let views = visits.iter().map(|visit| visit.views.to_vec()).enumerate().collect();
        Self { visits, max_distance, earlier: (0..visits.len()).collect(), views, joined: BTreeSet::new() }
    }

    /// Joins groups that links lead between, in the order of the links, where all that was seen of both is of
    /// one plane at these poses; returns the links that still lead from group to group. All views are compared,
    /// because the two of a link also agree where a ramp begins.
    pub(super) fn join(&mut self, links: &[Link], poses: &[Pose]) -> Result<Vec<Link>, Error> {
        let mut between = Vec::new();
        for link in links {
            let [one, other] = link.visits.map(|visit| self.first(visit));
            if one == other {
                continue;
            }
            let in_map = link.is_of_one_plane(self.visits);
            if !self.are_one([one, other], poses, in_map)? {
                between.push(link.clone());
                continue;
            }
            let (first, later) = (one.min(other), one.max(other));
            let views = self.views.remove(&later).unwrap_or_default();
            self.views.entry(first).or_default().extend(views);
            self.earlier[later] = first;
            if !in_map {
                let [a, b] = link.visits.map(|visit| self.visits[visit].plane);
                self.joined.insert([a.min(b), a.max(b)]);
            }
        }
        Ok(between)
    }

    /// Whether two groups are of one plane; two that one key frame has seen are not. What the map has as one
    /// plane (`in_map`) stays one as long as the map would associate it at these poses: the readings of a real
    /// sensor differ by more than its noise, since their scale is not quite right. What it has as two becomes
    /// one when they are no further apart than a right view may be from its plane.
    fn are_one(&self, groups: [usize; 2], poses: &[Pose], in_map: bool) -> Result<bool, Error> {
        let [one, other] = groups.map(|group| self.views.get(&group).map_or(&[][..], Vec::as_slice));
        let key_frames: BTreeSet<usize> = one.iter().map(|view| view.pose).collect();
        if other.iter().any(|view| key_frames.contains(&view.pose)) {
            return Ok(false);
        }
        let [fewer, more] = if one.len() < other.len() { [one, other] } else { [other, one] };
        if in_map {
            // With an information of 1, errors are in metres.
            let fewer: Vec<_> = fewer.iter().map(|view| PlaneView { information: 1.0, ..*view }).collect();
            let mean = PlaneView::misfit(&fewer, more, poses)? / fewer.len() as f64;
            return Ok(mean <= self.max_distance.powi(2));
        }
        let both = [fewer, more].concat();
        let apart = PlaneView::misfit(fewer, fewer, poses)? + PlaneView::misfit(more, more, poses)?;
        // Of two groups at a distance, the plane of both is nearer to that with more views. The squares of what
        // it is off all views add up to the squared distance over the sum of the inverse numbers of views.
        let inverse = 1.0 / fewer.len() as f64 + 1.0 / more.len() as f64;
        let squared_distance = (PlaneView::misfit(&both, &both, poses)? - apart) * inverse;
        Ok(squared_distance <= SolverConfig::default().max_view_error)
    }

    /// The first visit of a visit's group.
    fn first(&self, mut visit: usize) -> usize {
        while self.earlier[visit] != visit {
            visit = self.earlier[visit];
        }
        visit
    }

    /// The views of each group.
    pub(super) fn views(&self) -> impl ExactSizeIterator<Item = &[PlaneView]> {
        self.views.values().map(Vec::as_slice)
    }

    /// Number of pairs of planes of the map that have been joined.
    pub(super) fn joined_planes(&self) -> usize {
        self.joined.len()
    }

    /// Number of groups that planes of the map are in, beyond one each.
    pub(super) fn parted(&self) -> usize {
        let of_visit = |(index, visit): (usize, &PlaneVisit<'_>)| (visit.plane, self.first(index));
        let parts: BTreeSet<_> = self.visits.iter().enumerate().map(of_visit).collect();
        let planes: BTreeSet<_> = self.visits.iter().map(|visit| visit.plane).collect();
        parts.len() - planes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A patch of a floor of 2 x 2 m, seen from the origin: its middle is `ahead` and `up` of it, and it rises by
    /// `slope`.
    fn patch(pose: usize, ahead: f64, up: f64, slope: f64) -> PlaneView {
        let third = 1.0 / 3.0;
        // x to the right, y ahead, z up.
        let covariance = [third, 0.0, 0.0, third, third * slope, third * slope * slope];
        PlaneView { pose, information: 1.0 / (0.005 * 0.005), centroid: [0.0, ahead, up], covariance }
    }

    /// What becomes of visits to these planes of the map, when each is linked with each later one.
    struct Grouped {
        /// Numbers of views.
        sizes: Vec<usize>,
        /// Pairs of planes of the map that were joined, and groups of one plane beyond the first.
        joined_and_parted: [usize; 2],
    }

    fn grouped(visits: &[(u64, Vec<PlaneView>)]) -> Grouped {
        let visit = |(id, views): &'_ (u64, Vec<PlaneView>)| (PlaneId::new(*id), views.clone());
        let kept: Vec<(PlaneId, Vec<PlaneView>)> = visits.iter().map(visit).collect();
        let visits: Vec<PlaneVisit<'_>> =
            kept.iter().map(|(plane, views)| PlaneVisit { plane: *plane, views }).collect();
        let pairs = (0..visits.len()).flat_map(|one| (one + 1..visits.len()).map(move |other| [one, other]));
        let link = |pair: [usize; 2]| Link { visits: pair, views: pair.map(|visit| visits[visit].views[0]) };
        let links: Vec<Link> = pairs.map(link).collect();
        let mut groups = PlaneGroups::new(&visits, 0.05);
        groups.join(&links, &[Pose::identity(); 20]).unwrap();
        Grouped {
            sizes: groups.views().map(<[PlaneView]>::len).collect(),
            joined_and_parted: [groups.joined_planes(), groups.parted()],
        }
    }

    fn floor(first: usize, ahead: f64, up: f64) -> Vec<PlaneView> {
        (0..4).map(|k| patch(first + k, ahead, up, 0.0)).collect()
    }

    #[test]
    fn visits_to_one_plane_are_one_group() {
        let three = grouped(&[(0, floor(0, 0.0, 0.0)), (1, floor(4, 3.0, 0.0)), (1, floor(8, 9.0, 0.0))]);
        assert_eq!((three.sizes, three.joined_and_parted), (vec![12], [1, 0]));
        assert_eq!(grouped(&[(0, floor(0, 0.0, 0.0))]).sizes, [4]);
        assert!(grouped(&[]).sizes.is_empty());
    }

    /// Another plane lay where drift had put it when the second visit came: the first and the third are one.
    #[test]
    fn a_wrong_visit_is_parted_from_those_before_and_after_it() {
        let wrong = floor(4, 0.0, 0.3);
        let three = grouped(&[(0, floor(0, 0.0, 0.0)), (0, wrong), (0, floor(8, 1.0, 0.0))]);
        assert_eq!((three.sizes, three.joined_and_parted), (vec![8, 4], [0, 1]));
    }

    /// Two boards 1 cm apart, of which each is as near to a third visit as noise allows.
    #[test]
    fn what_one_key_frame_has_seen_as_two_stays_two() {
        let three = grouped(&[(0, floor(0, 0.0, 0.0)), (1, floor(0, 0.0, 0.01)), (0, floor(8, 0.0, 0.005))]);
        assert_eq!((three.sizes, three.joined_and_parted), (vec![8, 4], [0, 0]));
    }

    /// Where a ramp of 5 degrees begins, its patch and that of the floor are nearly one plane.
    #[test]
    fn a_ramp_is_not_of_the_floor_from_which_it_leads() {
        let slope = 5_f64.to_radians().tan();
        let floor: Vec<PlaneView> = (0..4).map(|k| patch(k, -1.0 - k as f64, 0.0, 0.0)).collect();
        let ramp: Vec<PlaneView> = (0..6).map(|k| patch(4 + k, k as f64, slope * k as f64, slope)).collect();
        assert_eq!(grouped(&[(0, floor.clone()), (1, ramp.clone())]).sizes, [4, 6]);
        assert_eq!(grouped(&[(0, floor), (0, ramp)]).sizes, [4, 6]);
    }

    /// A view has a deviation of 5 mm, and 4 of them are allowed: 2 cm. The map associates within 5 cm.
    #[test]
    fn what_the_map_has_as_one_stays_one_within_its_own_tolerance() {
        for (up, [two, one]) in [(0.015, [8, 8]), (0.03, [4, 8]), (0.045, [4, 8]), (0.06, [4, 4])] {
            let of = |planes: [u64; 2]| {
                grouped(&[(planes[0], floor(0, 0.0, 0.0)), (planes[1], floor(4, 0.5, up))]).sizes[0]
            };
            assert_eq!([of([0, 1]), of([0, 0])], [two, one], "{up} m");
        }
    }
}

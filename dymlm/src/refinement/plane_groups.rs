use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{PlaneId, Pose};
use dymlm_refine::{Error, PlaneView, SolverConfig};

use super::links::Link;
use super::plane_visits::PlaneVisit;

/// Visits that turned out to be of one plane, together.
pub(super) struct PlaneGroups<'a> {
    visits: &'a [PlaneVisit],
    /// Within which the map associates planes, metres.
    max_distance: f64,
    /// By visit, a visit of its group that is no later; the first one of a group has itself.
    earlier: Vec<usize>,
    /// The views of each group, by its first visit.
    views: BTreeMap<usize, Vec<PlaneView>>,
    /// Planes of the map that are in one group.
    one: BTreeSet<[PlaneId; 2]>,
}

impl<'a> PlaneGroups<'a> {
    /// Each visit a group of its own. `max_distance`: within which the map associates planes, metres.
    pub(super) fn new(visits: &'a [PlaneVisit], max_distance: f64) -> Self {
        let views = visits.iter().map(|visit| visit.views.clone()).enumerate().collect();
        Self { visits, max_distance, earlier: (0..visits.len()).collect(), views, one: BTreeSet::new() }
    }

    /// Joins groups that links lead between, where all that was seen of both is of one plane at these poses;
    /// returns the links that still lead from group to group. The two views of a link alone may agree where a
    /// ramp begins.
    pub(super) fn join(&mut self, links: &[Link], poses: &[Pose]) -> Result<Vec<Link>, Error> {
        let mut between = Vec::new();
        for link in links {
            let [one, other] = link.visits.map(|visit| self.first(visit));
            if one == other {
                continue;
            }
            if !self.are_one([one, other], poses, self.is_of_one_plane(link))? {
                between.push(link.clone());
                continue;
            }
            let (first, later) = (one.min(other), one.max(other));
            let views = self.views.remove(&later).unwrap_or_default();
            self.views.entry(first).or_default().extend(views);
            self.earlier[later] = first;
            let [a, b] = link.visits.map(|visit| self.visits[visit].plane);
            if a != b {
                self.one.insert([a.min(b), a.max(b)]);
            }
        }
        Ok(between)
    }

    /// Whether a link is between visits to one plane of the map.
    pub(super) fn is_of_one_plane(&self, link: &Link) -> bool {
        let [one, other] = link.visits.map(|visit| self.visits[visit].plane);
        one == other
    }

    /// Whether the views of the smaller of two groups are, on average, near enough to the plane of both. What
    /// the map has as one plane stays one as long as the map would associate it at these poses: the readings of
    /// a real sensor differ by more than its noise, since their scale is not quite right. What it has as two
    /// becomes one where noise explains how they differ.
    fn are_one(&self, groups: [usize; 2], poses: &[Pose], in_map: bool) -> Result<bool, Error> {
        // With an information of 1, errors are in metres.
        let scaled = |view: &PlaneView| if in_map { PlaneView { information: 1.0, ..*view } } else { *view };
        let [one, other] = groups.map(|group| {
            let views = self.views.get(&group).map_or(&[][..], Vec::as_slice);
            views.iter().map(scaled).collect::<Vec<_>>()
        });
        let apart = PlaneView::misfit(&one, poses)? + PlaneView::misfit(&other, poses)?;
        let smaller = one.len().min(other.len()) as f64;
        let together = PlaneView::misfit(&[one, other].concat(), poses)?;
        let most = if in_map { self.max_distance.powi(2) } else { SolverConfig::default().max_view_error };
        Ok(together - apart <= most * smaller)
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
        self.one.len()
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

    /// Sizes of the groups that visits to these planes of the map end in, when each is linked with the next.
    fn grouped(visits: &[(u64, Vec<PlaneView>)]) -> Vec<usize> {
        let visit = |(id, views): &(u64, Vec<PlaneView>)| PlaneVisit {
            plane: PlaneId::new(*id),
            views: views.clone(),
        };
        let visits: Vec<PlaneVisit> = visits.iter().map(visit).collect();
        let link = |next: usize| Link {
            visits: [next - 1, next],
            views: [visits[next - 1].views[0], visits[next].views[0]],
        };
        let links: Vec<Link> = (1..visits.len()).map(link).collect();
        let mut groups = PlaneGroups::new(&visits, 0.05);
        let between = groups.join(&links, &[Pose::identity(); 20]).unwrap();
        assert_eq!(groups.views().len(), visits.len() + between.len() - links.len());
        groups.views().map(<[PlaneView]>::len).collect()
    }

    fn floor(first: usize, ahead: f64, up: f64) -> Vec<PlaneView> {
        (0..4).map(|k| patch(first + k, ahead, up, 0.0)).collect()
    }

    #[test]
    fn visits_to_one_plane_are_one_group() {
        assert_eq!(
            grouped(&[(0, floor(0, 0.0, 0.0)), (1, floor(4, 3.0, 0.0)), (0, floor(8, 9.0, 0.0))]),
            [12]
        );
        assert_eq!(grouped(&[(0, floor(0, 0.0, 0.0))]), [4]);
        assert!(grouped(&[]).is_empty());
    }

    /// Where a ramp of 5 degrees begins, its patch and that of the floor are nearly one plane.
    #[test]
    fn a_ramp_is_not_of_the_floor_from_which_it_leads() {
        let slope = 5_f64.to_radians().tan();
        let floor: Vec<PlaneView> = (0..4).map(|k| patch(k, -1.0 - k as f64, 0.0, 0.0)).collect();
        let ramp: Vec<PlaneView> = (0..6).map(|k| patch(4 + k, k as f64, slope * k as f64, slope)).collect();
        assert_eq!(grouped(&[(0, floor.clone()), (1, ramp.clone())]), [4, 6]);
        assert_eq!(grouped(&[(0, floor), (0, ramp)]), [4, 6]);
    }

    /// 6 cm are 12 deviations of a view, of which the plane between takes half from each: too far for planes that
    /// the map has as two, and not for one that it has as one, as long as it would associate it again.
    #[test]
    fn what_the_map_has_as_one_stays_one_within_its_own_tolerance() {
        for (up, [two, one]) in [(0.015, [8, 8]), (0.06, [4, 8]), (0.12, [4, 4])] {
            let of = |planes: [u64; 2]| {
                grouped(&[(planes[0], floor(0, 0.0, 0.0)), (planes[1], floor(4, 0.5, up))])[0]
            };
            assert_eq!([of([0, 1]), of([0, 0])], [two, one], "{up} m");
        }
    }
}

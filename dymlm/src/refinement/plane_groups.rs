use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{PlaneId, Pose};
use dymlm_refine::{Error, PlaneView, SolverConfig};

use super::links::Link;
use super::plane_visits::PlaneVisit;

/// Visits that turned out to be of one plane, together.
pub(super) struct PlaneGroups<'a> {
    visits: &'a [PlaneVisit],
    /// By visit, a visit of its group that is no later; the first one of a group has itself.
    earlier: Vec<usize>,
    /// The views of each group, by its first visit.
    views: BTreeMap<usize, Vec<PlaneView>>,
    /// Planes of the map that are in one group.
    one: BTreeSet<[PlaneId; 2]>,
}

impl<'a> PlaneGroups<'a> {
    /// Each visit a group of its own.
    pub(super) fn new(visits: &'a [PlaneVisit]) -> Self {
        let views = visits.iter().map(|visit| visit.views.clone()).enumerate();
        Self { visits, earlier: (0..visits.len()).collect(), views: views.collect(), one: BTreeSet::new() }
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
            if !self.are_one([one, other], poses)? {
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

    /// Whether the views of the smaller of two groups are, on average, no farther from the plane of both than
    /// a right view may be.
    fn are_one(&self, groups: [usize; 2], poses: &[Pose]) -> Result<bool, Error> {
        let [one, other] = groups.map(|group| self.views.get(&group).map_or(&[][..], Vec::as_slice));
        let together = PlaneView::misfit(&[one, other].concat(), poses)?;
        let apart = PlaneView::misfit(one, poses)? + PlaneView::misfit(other, poses)?;
        let smaller = one.len().min(other.len()) as f64;
        Ok(together - apart <= SolverConfig::default().max_view_error * smaller)
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

    /// Pairs of planes of the map that have been joined.
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

    fn joined(visits: &[Vec<PlaneView>]) -> Vec<usize> {
        let visits: Vec<PlaneVisit> = (0..)
            .zip(visits)
            .map(|(id, views)| PlaneVisit { plane: PlaneId::new(id), views: views.clone() })
            .collect();
        let link = |next: usize| Link {
            visits: [next - 1, next],
            views: [visits[next - 1].views[0], visits[next].views[0]],
        };
        let links: Vec<Link> = (1..visits.len()).map(link).collect();
        let poses = vec![Pose::identity(); 20];
        let mut groups = PlaneGroups::new(&visits);
        let between = groups.join(&links, &poses).unwrap();
        assert_eq!(groups.joined_planes(), links.len() - between.len());
        groups.views().map(<[PlaneView]>::len).collect()
    }

    #[test]
    fn visits_to_one_plane_are_one_group() {
        let floor = |first: usize, ahead: f64| (0..4).map(|k| patch(first + k, ahead, 0.002, 0.0)).collect();
        assert_eq!(joined(&[floor(0, 0.0), floor(4, 3.0), floor(8, 9.0)]), [12]);
        assert_eq!(joined(&[floor(0, 0.0)]), [4]);
        assert!(joined(&[]).is_empty());
    }

    /// Where a ramp of 5 degrees begins, its patch and that of the floor are nearly one plane.
    #[test]
    fn a_ramp_is_not_of_the_floor_from_which_it_leads() {
        let slope = 5_f64.to_radians().tan();
        let floor: Vec<PlaneView> = (0..4).map(|k| patch(k, -1.0 - k as f64, 0.0, 0.0)).collect();
        let ramp = (0..6).map(|k| patch(4 + k, k as f64, slope * k as f64, slope)).collect();
        assert_eq!(joined(&[floor, ramp]), [4, 6]);
    }
}

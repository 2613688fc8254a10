use dymlm_core::Point;

use super::BoxTree;
use super::tree::{Node, squared_distance};

impl BoxTree {
    /// Visits the leaves that may hold points nearer than a squared distance, from a place, mostly from near
    /// to far. `visit` is given a leaf and its least squared distance, and returns the squared distance from
    /// which on points are of no use then. `open` is a buffer to reuse.
    #[inline]
    pub(super) fn visit_leaves(
        &self,
        place: Point,
        mut bound: f32,
        open: &mut Vec<(f32, u32)>,
        mut visit: impl FnMut(&Node, f32) -> f32,
    ) {
        open.clear();
        open.extend(self.root().map(|root| (self.node(root).least_from(place), root)));
        while let Some((mut least, mut node)) = open.pop() {
            while least < bound {
                let Some(children) = self.children(node) else {
                    bound = visit(self.node(node), least);
                    break;
                };
                let [a, b] = children.map(|child| (self.node(child).least_from(place), child));
                let (near, far) = if b.0 < a.0 { (b, a) } else { (a, b) };
                if far.0 < bound {
                    open.push(far);
                }
                (least, node) = near;
            }
        }
    }

    /// Index and squared distance of a point nearest to a place, of those within a distance of it.
    pub(crate) fn nearest_within(&self, place: Point, squared_distance_limit: f32) -> Option<(u32, f32)> {
        let mut found = None;
        let mut bound = squared_distance_limit.next_up();
        self.visit_leaves(place, bound, &mut Vec::with_capacity(32), |leaf, _| {
            // In a box without extent, all points are equal.
            for (at, &point) in (leaf.first as usize..).zip(self.distinct_points_of(leaf)) {
                let distance = squared_distance(place, point);
                if distance < bound {
                    (bound, found) = (distance, Some(at));
                }
            }
            bound
        });
        found.map(|at| (self.indices()[at], bound))
    }

    /// Indices of the points within a distance of a place.
    pub(crate) fn all_within(&self, place: Point, squared_distance_limit: f32) -> impl Iterator<Item = u32> {
        let mut open = Vec::with_capacity(32);
        open.extend(self.root());
        let leaves = std::iter::from_fn(move || {
            while let Some(number) = open.pop() {
                let node = self.node(number);
                if node.least_from(place) > squared_distance_limit {
                    continue;
                }
                match self.children(number) {
                    Some(children) => open.extend(children),
                    None => return Some(node),
                }
            }
            None
        });
        leaves
            .flat_map(move |node| {
                let points = self.points_of(node).iter().zip(&self.indices()[node.first as usize..]);
                points.filter(move |(point, _)| squared_distance(place, **point) <= squared_distance_limit)
            })
            .map(|(_, &index)| index)
    }
}

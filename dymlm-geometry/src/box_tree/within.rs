use dymlm_core::Point;

use super::BoxTree;
use super::tree::squared_distance;

impl BoxTree {
    /// Index and squared distance of a point nearest to a place, of those within a distance of it.
    pub(crate) fn nearest_within(&self, place: Point, squared_distance_limit: f32) -> Option<(u32, f32)> {
        let mut found = None;
        // Points from here on are of no use.
        let mut bound = squared_distance_limit.next_up();
        let mut open = Vec::with_capacity(32);
        open.extend(self.root().map(|root| (self.node(root).least_from(place), root)));
        while let Some((least, mut node)) = open.pop() {
            let mut least = least;
            while least < bound {
                let Some(children) = self.children(node) else {
                    self.look_into_leaf(node, place, &mut bound, &mut found);
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
        found.map(|at: usize| (self.indices()[at], bound))
    }

    fn look_into_leaf(&self, leaf: u32, place: Point, bound: &mut f32, found: &mut Option<usize>) {
        let node = self.node(leaf);
        // In a box without extent, all points are equal.
        let points = self.distinct_points_of(node);
        for (at, &point) in (node.first as usize..).zip(points) {
            let distance = squared_distance(place, point);
            if distance < *bound {
                (*bound, *found) = (distance, Some(at));
            }
        }
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

use dymlm_core::Point;

use super::BoxTree;
use super::tree::squared_distance;

impl BoxTree {
    /// Whether at least `enough` points lie within a distance of a place.
    ///
    /// Boxes are opened from the largest to the smallest, and only while the boxes that the sphere cuts can
    /// still decide the answer. `front` and `next` are buffers to reuse.
    pub(crate) fn has_within(
        &self,
        place: Point,
        squared_distance_limit: f32,
        enough: usize,
        [front, next]: [&mut Vec<u32>; 2],
    ) -> bool {
        front.clear();
        front.extend(self.root());
        // Number of points that are within, and of points that may be.
        let (mut within, mut open) = (0, self.points().len());
        while within < enough && within + open >= enough && !front.is_empty() {
            next.clear();
            for &node in &*front {
                for child in self.children(node).into_iter().flatten() {
                    let node = self.node(child);
                    if node.least_from(place) > squared_distance_limit {
                        open -= node.len();
                    } else if node.most_from(place) <= squared_distance_limit {
                        open -= node.len();
                        within += node.len();
                    } else {
                        next.push(child);
                    }
                }
                if self.children(node).is_none() {
                    let node = self.node(node);
                    let near = |point: &&Point| squared_distance(place, **point) <= squared_distance_limit;
                    // All points of a box without extent are equally far; other leaves hold few points.
                    within += if node.least_from(place) == node.most_from(place) {
                        usize::from(node.most_from(place) <= squared_distance_limit) * node.len()
                    } else {
                        self.points_of(node).iter().filter(near).count()
                    };
                    open -= node.len();
                }
            }
            std::mem::swap(front, next);
        }
        within >= enough
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn counts_as_one_by_one(
            points in prop::collection::vec(prop::array::uniform3(-6..6_i8), 0..300),
            exponent in -160..120_i32,
            place in prop::array::uniform3(-8..8_i8),
            squared in 0..200_u8,
            enough in 0..320_usize,
        ) {
            let scale = 2.0_f64.powi(exponent) as f32;
            let scaled = |p: [i8; 3]| p.map(|x| f32::from(x) * scale);
            let points: Vec<Point> = points.into_iter().map(scaled).collect();
            let (place, limit) = (scaled(place), (f32::from(squared) * scale) * scale);
            let count = points.iter().filter(|&&point| squared_distance(place, point) <= limit).count();
            let tree = BoxTree::new(points.into_iter());
            let found = tree.has_within(place, limit, enough, [&mut Vec::new(), &mut Vec::new()]);
            prop_assert_eq!(found, count >= enough);
        }
    }
}

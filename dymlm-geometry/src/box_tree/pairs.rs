use super::BoxTree;
use super::tree::squared_distance;

impl BoxTree {
    /// Whether any point lies within a distance of any point of another tree.
    pub(crate) fn has_pair_within(&self, other: &Self, squared_distance_limit: f32) -> bool {
        let mut open: Vec<[u32; 2]> = Vec::new();
        open.extend(self.root().zip(other.root()).map(|(a, b)| [a, b]));
        while let Some([a, b]) = open.pop() {
            let (node, others) = (self.node(a), other.node(b));
            if node.least_between(others) > squared_distance_limit {
                continue;
            }
            if node.most_between(others) <= squared_distance_limit {
                return true;
            }
            match (self.children(a), other.children(b)) {
                (Some(children), None) => open.extend(children.map(|a| [a, b])),
                (None, Some(children)) => open.extend(children.map(|b| [a, b])),
                (Some(children), Some(_)) if node.len() >= others.len() => {
                    open.extend(children.map(|a| [a, b]));
                }
                (Some(_), Some(children)) => open.extend(children.map(|b| [a, b])),
                (None, None) => {
                    let theirs = other.distinct_points_of(others);
                    let near = |&a| theirs.iter().any(|&b| squared_distance(a, b) <= squared_distance_limit);
                    if self.distinct_points_of(node).iter().any(near) {
                        return true;
                    }
                }
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::Point;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn finds_what_one_by_one_finds(
            clouds in [(); 2].map(|()| prop::collection::vec(prop::array::uniform3(-6..6_i8), 0..100)),
            exponent in -160..120_i32,
            squared in 0..200_u8,
        ) {
            let scale = 2.0_f64.powi(exponent) as f32;
            let clouds: [Vec<Point>; 2] =
                clouds.map(|points| points.into_iter().map(|p| p.map(|x| f32::from(x) * scale)).collect());
            let limit = (f32::from(squared) * scale) * scale;
            let near = |a: &Point| clouds[1].iter().any(|&b| squared_distance(*a, b) <= limit);
            let expected = clouds[0].iter().any(near);
            let [a, b] = clouds.map(|points| BoxTree::new(points.into_iter()));
            prop_assert_eq!(a.has_pair_within(&b, limit), expected);
        }
    }
}

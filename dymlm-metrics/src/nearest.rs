use std::num::NonZero;

use dymlm_core::Point;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// Distance within which a map's content matches the truth, metres: the tolerance of the `DynamicMap`
/// benchmark, and the distance at which planes are associated.
pub(crate) const MATCHED: f32 = 0.05;
/// The same for the surface of thin things, which is close to other surfaces.
pub(crate) const MATCHED_THIN: f32 = 0.02;
/// Distance beyond which a point of a map is off all surfaces, metres: three standard deviations of a
/// Kinect's noise at 3.5 m.
pub(crate) const OFF_SURFACE: f32 = 0.06;

/// Side of the cells in which surface is counted, metres: areas of planes, readings of a label. Smaller cells
/// are more exact and take more memory; at this side, shares are off by less than 2 %.
pub(crate) const CELL: f64 = 0.02;

/// The finite points of a set, for searches of the nearest one.
#[derive(Debug)]
pub(crate) struct Neighbors {
    /// `None` without points: in an empty tree, the nearest point would be one that does not exist.
    tree: Option<ImmutableKdTree<f32, 3>>,
}

impl Neighbors {
    pub(crate) fn of(points: &[Point]) -> Self {
        let points: Vec<Point> = points.iter().copied().filter(is_finite).collect();
        let tree = if points.is_empty() { None } else { ImmutableKdTree::new_from_slice(&points).ok() };
        Self { tree }
    }

    /// Distance to the nearest point, metres; infinite if there is none, or if `place` is not finite.
    pub(crate) fn distance(&self, place: Point) -> f32 {
        let Some(tree) = self.tree.as_ref().filter(|_| is_finite(&place)) else { return f32::INFINITY };
        let nearest = tree.query(&place).nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN).execute();
        nearest.first().map_or(f32::INFINITY, |found| found.distance.sqrt())
    }

    /// Whether a point is within `reach` metres of a place.
    pub(crate) fn reach(&self, place: Point, reach: f32) -> bool {
        self.tree.as_ref().filter(|_| is_finite(&place)).is_some_and(|tree| {
            // Limited to `reach`: far from all points, an unlimited search visits half of the tree.
            let nearest = tree.query(&place).nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN);
            !nearest.within(reach * reach).execute().is_empty()
        })
    }
}

pub(crate) fn is_finite(point: &Point) -> bool {
    point.iter().all(|c| c.is_finite())
}

/// Share of the `asked` points that have one of `points` within `reach` metres; `None` when `asked` is empty.
pub(crate) fn share_within(asked: &[Point], points: &[Point], reach: f32) -> Option<f64> {
    let neighbors = Neighbors::of(points);
    let covered = asked.iter().filter(|&&point| neighbors.reach(point, reach)).count();
    crate::share::share(covered as u64, asked.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_is_within_reach() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0]];
        assert_eq!(
            share_within(&[[0.25, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.125, 0.0]], &points, 0.25),
            Some(2.0 / 3.0)
        );
        assert_eq!(share_within(&[[0.0; 3]], &[], 1.0), Some(0.0));
        assert_eq!(share_within(&[], &points, 1.0), None);
    }

    #[test]
    fn points_on_one_plane_and_all_alike_are_no_trouble() {
        let plane: Vec<Point> =
            (0..5000).map(|i| [(i % 70) as f32 * 0.02, (i / 70) as f32 * 0.02, 1.0]).collect();
        assert_eq!(share_within(&plane, &plane, 0.0), Some(1.0));
        assert_eq!(share_within(&[[0.0; 3], [2.0; 3]], &[[2.0; 3]; 1000], 0.1), Some(0.5));
    }
}

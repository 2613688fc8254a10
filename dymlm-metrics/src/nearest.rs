use std::num::NonZero;

use dymlm_core::Point;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// Tells which places have one of a set of points within reach.
#[derive(Debug)]
pub(crate) struct Neighbors {
    /// No tree of no points: its nearest would be an item that is not there.
    tree: Option<ImmutableKdTree<f32, 3>>,
    reach: f32,
}

impl Neighbors {
    /// Of finite `points`, within `reach` metres.
    pub(crate) fn of(points: &[Point], reach: f32) -> Self {
        let tree = if points.is_empty() { None } else { ImmutableKdTree::new_from_slice(points).ok() };
        Self { tree, reach }
    }

    /// Whether one of the points is within reach of a finite place.
    pub(crate) fn reach(&self, place: Point) -> bool {
        self.tree.as_ref().is_some_and(|tree| {
            // Not the nearest one of all: far from all points that search goes through half of the tree.
            let reach = self.reach * self.reach;
            let nearest = tree.query(&place).nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN);
            !nearest.within(reach).execute().is_empty()
        })
    }
}

/// Share of the `asked` points with one of `points` within `reach` metres; `None` when nothing is asked. All
/// must be finite.
pub(crate) fn share_within(asked: &[Point], points: &[Point], reach: f32) -> Option<f64> {
    if asked.is_empty() {
        return None;
    }
    let neighbors = Neighbors::of(points, reach);
    let covered = asked.iter().filter(|&&point| neighbors.reach(point)).count();
    Some(covered as f64 / asked.len() as f64)
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

use dymlm_core::Point;

use crate::box_tree::BoxTree;
use crate::finite::is_finite;

/// Points, for searches by distance: a tree of tight boxes that does not change.
///
/// Points that are not finite are left out, as are those after the first 2^32 - 1. Searches stay short for
/// points in planes, on lines and in heaps of equal ones, on which trees that are cut along each axis in turn
/// grow deep. O(n log n) to build, O(log n) for a search that finds few points.
///
/// Distances are computed in f32: from a place on, that is so far away that their squares overflow (1.8e19
/// m), nothing is found.
///
/// ```
/// use dymlm_geometry::PointTree;
///
/// let tree = PointTree::new(&[[0.0, 0.0, 1.0], [0.0, 2.0, 1.0], [f32::NAN; 3]]);
/// assert_eq!(tree.nearest([0.0, 1.5, 1.0]), Some((1, 0.5)));
/// assert_eq!(tree.nearest_within([0.0, 1.5, 1.0], 0.25), None);
/// assert_eq!(tree.within([0.0, 0.5, 1.0], 1.0).collect::<Vec<_>>(), [0]);
/// ```
#[derive(Debug, Clone, Default)]
pub struct PointTree {
    tree: BoxTree,
}

impl PointTree {
    /// A tree of points.
    pub fn new(points: &[Point]) -> Self {
        let numbered = points.iter().copied().zip(0..u32::MAX);
        Self { tree: BoxTree::of_numbered(numbered.filter(|(point, _)| is_finite(point)).collect()) }
    }

    /// Number of finite points.
    pub fn len(&self) -> usize {
        self.tree.points().len()
    }

    /// Whether there is no finite point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Index and distance, metres, of the point nearest to a place; of one of them where several are as near.
    /// `None` without a finite point, and from a place that is not finite.
    pub fn nearest(&self, place: Point) -> Option<(usize, f32)> {
        self.nearest_within(place, f32::INFINITY)
    }

    /// As [`nearest`](Self::nearest), of the points at most `reach` metres away: far from all points, this is
    /// faster by far.
    pub fn nearest_within(&self, place: Point, reach: f32) -> Option<(usize, f32)> {
        let (index, squared) = self.tree.nearest_within(place, squared(reach))?;
        Some((index as usize, squared.sqrt()))
    }

    /// Indices of the points at most `reach` metres from a place, in no order.
    pub fn within(&self, place: Point, reach: f32) -> impl Iterator<Item = usize> {
        self.tree.all_within(place, squared(reach)).map(|index| index as usize)
    }
}

/// NaN, within which nothing is, for a negative distance.
fn squared(reach: f32) -> f32 {
    if reach >= 0.0 { reach * reach } else { f32::NAN }
}

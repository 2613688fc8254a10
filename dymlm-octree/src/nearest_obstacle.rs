use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::Octree;
use crate::lattice::Key;
use crate::occupancy_model::OccupancyModel;
use crate::storage::{Kind, Subtree, child_corner};

/// The occupied leaf nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct NearestObstacle {
    /// Distance from the point to the leaf's nearest face, metres; 0 inside it.
    pub distance: f64,
    /// The leaf's point nearest to the given point, metres.
    pub point: [f64; 3],
    /// Centre of the leaf, metres.
    pub center: [f64; 3],
    /// Side of the leaf, metres.
    pub size: f64,
}

/// A node to visit, ordered by its distance; at equal distances inner nodes come first, then the lower key.
#[derive(Debug, Clone, Copy)]
struct Candidate<'a> {
    squared: f64,
    corner: Key,
    subtree: Subtree<'a>,
}

impl Octree {
    /// The occupied leaf nearest to `point`, if one is within `max_distance` metres (infinite for no limit).
    /// Of leaves equally near, the one with the lowest key (x before y before z) is the answer. `None` also
    /// when the point is not finite, or so far away that the square of the distance is not.
    ///
    /// Best-first search (Hjaltason and Samet 1999) over the nodes that hold anything occupied: O(log n)
    /// nodes for an obstacle close by.
    ///
    /// ```
    /// # use dymlm_octree::{Octree, OctreeConfig};
    /// # let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0; 3], &[[1.02, 0.02, 0.02]])?;
    /// let nearest = map.nearest_obstacle([0.02, 0.02, 0.02], 3.0).unwrap();
    /// assert!((nearest.distance - 0.98).abs() < 1e-9);
    /// assert_eq!(map.nearest_obstacle([0.02, 0.02, 0.02], 0.5), None);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn nearest_obstacle(&self, point: [f64; 3], max_distance: f64) -> Option<NearestObstacle> {
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            return None;
        }
        let limit = max_distance.max(0.0) * max_distance.max(0.0);
        let mut queue = BinaryHeap::new();
        self.enqueue(self.tree.subtree(), [0; 3], point, limit, &mut queue);
        while let Some(Reverse(Candidate { subtree, corner, .. })) = queue.pop() {
            if let Kind::Inner = subtree.kind() {
                for i in 0..8 {
                    let child = subtree.child(i);
                    self.enqueue(child, child_corner(corner, subtree.depth(), i), point, limit, &mut queue);
                }
            } else {
                return Some(self.obstacle(subtree, corner, point));
            }
        }
        None
    }

    /// Adds a node to the queue if it holds anything occupied within the limit.
    fn enqueue<'a>(
        &self,
        subtree: Subtree<'a>,
        corner: Key,
        point: [f64; 3],
        limit: f64,
        queue: &mut BinaryHeap<Reverse<Candidate<'a>>>,
    ) {
        if subtree.max_log_odds().is_some_and(OccupancyModel::is_occupied) {
            let nearest = self.nearest_in(subtree, corner, point);
            let squared = (0..3).map(|axis| (nearest[axis] - point[axis]).powi(2)).sum();
            if f64::is_finite(squared) && squared <= limit {
                queue.push(Reverse(Candidate { squared, corner, subtree }));
            }
        }
    }

    /// The point of a node nearest to `point`.
    fn nearest_in(&self, subtree: Subtree<'_>, corner: Key, point: [f64; 3]) -> [f64; 3] {
        let min = self.lattice.corner(corner);
        let size = self.lattice.size(subtree.depth());
        std::array::from_fn(|axis| point[axis].clamp(min[axis], min[axis] + size))
    }

    fn obstacle(&self, subtree: Subtree<'_>, corner: Key, point: [f64; 3]) -> NearestObstacle {
        let nearest = self.nearest_in(subtree, corner, point);
        let size = self.lattice.size(subtree.depth());
        NearestObstacle {
            distance: (0..3).map(|axis| (nearest[axis] - point[axis]).powi(2)).sum::<f64>().sqrt(),
            point: nearest,
            center: self.lattice.corner(corner).map(|coordinate| coordinate + 0.5 * size),
            size,
        }
    }
}

impl Ord for Candidate<'_> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        // An inner node may hold a leaf with a lower key than that of a leaf at the same distance, whatever the
        // size of the leaves.
        let is_leaf = |candidate: &Self| !matches!(candidate.subtree.kind(), Kind::Inner);
        self.squared
            .total_cmp(&other.squared)
            .then(is_leaf(self).cmp(&is_leaf(other)))
            .then(self.corner.cmp(&other.corner))
    }
}

impl PartialOrd for Candidate<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate<'_> {}

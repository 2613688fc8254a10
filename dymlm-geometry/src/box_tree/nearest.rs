use dymlm_core::Point;

use super::BoxTree;

/// The squared distances of the points nearest to a place, ascending. A buffer to reuse.
#[derive(Debug, Clone)]
pub(crate) struct Nearest {
    /// As many as are wanted; infinite where no point is found yet.
    distances: Vec<f32>,
    /// Squared distance from which on points are of no use: the last of `distances`.
    bound: f32,
    /// Nodes to search, with their least squared distances.
    open: Vec<(f32, u32)>,
}

impl Nearest {
    /// A buffer for searches of `wanted` points.
    pub(crate) fn new(wanted: usize) -> Self {
        Self { distances: vec![f32::INFINITY; wanted], bound: f32::INFINITY, open: Vec::new() }
    }

    /// The squared distances of the nearest points of a tree, ascending: of all points where there are fewer
    /// than wanted, without points that are infinitely far.
    ///
    /// Points as far as the last one found are skipped: of many equally far points, few are compared.
    pub(crate) fn find(&mut self, tree: &BoxTree, place: Point) -> &[f32] {
        self.distances.fill(f32::INFINITY);
        self.bound = f32::INFINITY;
        let mut open = std::mem::take(&mut self.open);
        tree.visit_leaves(place, self.bound, &mut open, |leaf, least| {
            self.look_into(tree.runs_of(leaf), least, place);
            self.bound
        });
        self.open = open;
        let found = self.distances.partition_point(|distance| distance.is_finite());
        &self.distances[..found]
    }

    fn look_into<'a>(
        &mut self,
        runs: impl Iterator<Item = ([&'a [f32; BoxTree::RUN]; 3], usize)>,
        least: f32,
        place: Point,
    ) {
        for (coordinates, len) in runs {
            if least >= self.bound {
                return;
            }
            // The points of a run together, without branches.
            let mut found = [0.0; BoxTree::RUN];
            for (others, x) in coordinates.into_iter().zip(place) {
                for (found, other) in found.iter_mut().zip(others) {
                    *found += (x - other) * (x - other);
                }
            }
            for &distance in &found[..len] {
                if distance < self.bound {
                    self.take(distance);
                }
            }
        }
    }

    #[inline]
    fn take(&mut self, distance: f32) {
        let Some(mut at) = self.distances.len().checked_sub(1) else { return };
        while at > 0 && self.distances[at - 1] > distance {
            self.distances[at] = self.distances[at - 1];
            at -= 1;
        }
        self.distances[at] = distance;
        self.bound = self.distances.last().copied().unwrap_or(0.0);
    }
}

use dymlm_core::Point;

use super::BoxTree;
use super::tree::squared_distance;

/// A tree of points with labels.
#[derive(Debug, Clone)]
pub(crate) struct LeastLabels {
    tree: BoxTree,
    /// The least label in each node.
    least: Vec<u32>,
    /// The label of each point, in the order of the tree.
    labels: Vec<u32>,
}

impl LeastLabels {
    /// A tree of finite points and their labels.
    pub(crate) fn new(points: impl Iterator<Item = Point>, labels: &[u32]) -> Self {
        let tree = BoxTree::new(points);
        let label = |&index: &u32| labels.get(index as usize).copied().unwrap_or(u32::MAX);
        let labels: Vec<u32> = tree.indices().iter().map(label).collect();
        let mut least = vec![u32::MAX; tree.nodes().len()];
        // Children come after their parents.
        for node in (0..least.len() as u32).rev() {
            least[node as usize] = if let Some(children) = tree.children(node) {
                children.map(|child| least[child as usize]).into_iter().min()
            } else {
                let node = tree.node(node);
                labels[node.first as usize..node.end as usize].iter().copied().min()
            }
            .unwrap_or(u32::MAX);
        }
        Self { tree, least, labels }
    }

    /// The least label of the points within a distance of a place; `u32::MAX` when there are none. `open` is
    /// a buffer to reuse.
    pub(crate) fn within(&self, place: Point, squared_distance_limit: f32, open: &mut Vec<u32>) -> u32 {
        let mut best = u32::MAX;
        open.clear();
        open.extend(self.tree.root());
        while let Some(node) = open.pop() {
            let (node, least) = (self.tree.node(node), node);
            let least_label = self.least[least as usize];
            if least_label >= best || node.least_from(place) > squared_distance_limit {
                continue;
            }
            if node.most_from(place) <= squared_distance_limit {
                best = least_label;
            } else if let Some([first, second]) = self.tree.children(least) {
                open.push(second);
                open.push(first);
            } else {
                let points = self.tree.points_of(node).iter().zip(&self.labels[node.first as usize..]);
                for (&point, &label) in points {
                    if label < best && squared_distance(place, point) <= squared_distance_limit {
                        best = label;
                    }
                }
            }
        }
        best
    }
}

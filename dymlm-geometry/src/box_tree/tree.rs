use dymlm_core::Point;

/// Most points of a leaf: comparing this many is faster than testing another box.
const LEAF: usize = BoxTree::RUN;

/// Points in tight boxes, each halved along its longest side: O(n log n) to build.
///
/// Halving along each axis in turn would do for points that fill space; but depth cameras see points in
/// planes (walls), on lines (edges) and in heaps of equal points (a world at rest). A box without extent is a
/// leaf, however many points are in it.
///
/// Squared distances are `dx * dx + dy * dy + dz * dz` in f32, in this order. Rounding is monotone, so that
/// the distances of boxes bound those of points without a margin, even where squares vanish or overflow.
/// Points are finite.
#[derive(Debug, Clone, Default)]
pub(crate) struct BoxTree {
    /// Each node is before its children, its first child right after it.
    nodes: Vec<Node>,
    points: Vec<Point>,
    /// Coordinates of the points, axis by axis, and [`BoxTree::RUN`] more values.
    coordinates: [Vec<f32>; 3],
    /// Index of each point in the order in which the points were given.
    indices: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    min: Point,
    max: Point,
    pub(super) first: u32,
    pub(super) end: u32,
    /// The second child; 0 for a leaf.
    second: u32,
}

impl Node {
    #[inline]
    pub(super) fn len(&self) -> usize {
        (self.end - self.first) as usize
    }

    /// A lower bound of the squared distances of its points from a point.
    #[inline]
    pub(super) fn least_from(&self, point: Point) -> f32 {
        squared(std::array::from_fn(|i| (self.min[i] - point[i]).max(point[i] - self.max[i]).max(0.0)))
    }

    /// An upper bound of the squared distances of its points from a point.
    #[inline]
    pub(super) fn most_from(&self, point: Point) -> f32 {
        squared(std::array::from_fn(|i| (point[i] - self.min[i]).max(self.max[i] - point[i])))
    }

    /// A lower bound of the squared distances between its points and those of another node.
    #[inline]
    pub(super) fn least_between(&self, other: &Self) -> f32 {
        squared(std::array::from_fn(|i| {
            (self.min[i] - other.max[i]).max(other.min[i] - self.max[i]).max(0.0)
        }))
    }

    /// An upper bound of the squared distances between its points and those of another node.
    #[inline]
    pub(super) fn most_between(&self, other: &Self) -> f32 {
        squared(std::array::from_fn(|i| (self.max[i] - other.min[i]).max(other.max[i] - self.min[i])))
    }
}

#[inline]
pub(super) fn squared_distance(a: Point, b: Point) -> f32 {
    squared(std::array::from_fn(|i| a[i] - b[i]))
}

#[inline]
fn squared([x, y, z]: Point) -> f32 {
    x * x + y * y + z * z
}

impl BoxTree {
    /// Number of points that are compared together.
    pub(super) const RUN: usize = 16;

    /// A tree of finite points; points after the first 2^32 - 1 are left out.
    pub(crate) fn new(points: impl Iterator<Item = Point>) -> Self {
        Self::of_numbered(points.zip(0..u32::MAX).collect())
    }

    /// A tree of finite points with the numbers that [`Self::indices`] gives them.
    pub(crate) fn of_numbered(mut entries: Vec<(Point, u32)>) -> Self {
        let mut nodes = Vec::with_capacity(2 * entries.len().div_ceil(LEAF) + 1);
        if !entries.is_empty() {
            add_node(&mut nodes, &mut entries, 0);
        }
        let (points, indices): (Vec<Point>, _) = entries.into_iter().unzip();
        let along = |axis: usize| points.iter().map(|point| point[axis]).chain([0.0; Self::RUN]).collect();
        let coordinates = [along(0), along(1), along(2)];
        Self { nodes, points, coordinates, indices }
    }

    /// The points in the order of the tree: neighbours mostly lie side by side.
    #[inline]
    pub(crate) fn points(&self) -> &[Point] {
        &self.points
    }

    /// The index that each of [`Self::points`] had among the points given.
    #[inline]
    pub(crate) fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// Number of the node that holds all others; `None` without a point.
    #[inline]
    pub(super) fn root(&self) -> Option<u32> {
        (!self.nodes.is_empty()).then_some(0)
    }

    #[inline]
    pub(super) fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    #[inline]
    pub(super) fn node(&self, node: u32) -> &Node {
        &self.nodes[node as usize]
    }

    /// `None` for a leaf.
    #[inline]
    pub(super) fn children(&self, node: u32) -> Option<[u32; 2]> {
        let second = self.node(node).second;
        (second > 0).then_some([node + 1, second])
    }

    #[inline]
    pub(super) fn points_of(&self, node: &Node) -> &[Point] {
        &self.points[node.first as usize..node.end as usize]
    }

    /// The coordinates of a leaf's points, by axis, and how many of them are points.
    #[inline]
    pub(super) fn runs_of(
        &self,
        node: &Node,
    ) -> impl Iterator<Item = ([&[f32; Self::RUN]; 3], usize)> + use<'_> {
        let (first, end) = (node.first as usize, node.end as usize);
        (first..end).step_by(Self::RUN).filter_map(move |start| {
            let [x, y, z] = &self.coordinates;
            Some((
                [
                    x.get(start..)?.first_chunk()?,
                    y.get(start..)?.first_chunk()?,
                    z.get(start..)?.first_chunk()?,
                ],
                (end - start).min(Self::RUN),
            ))
        })
    }

    /// The points of a leaf, or one of them where all are equal.
    #[inline]
    pub(super) fn distinct_points_of(&self, node: &Node) -> &[Point] {
        let points = self.points_of(node);
        if node.min == node.max { &points[..1] } else { points }
    }
}

/// The depth of the recursion is the logarithm of the number of points.
fn add_node(nodes: &mut Vec<Node>, entries: &mut [(Point, u32)], first: u32) {
    let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for (point, _) in &*entries {
        for axis in 0..3 {
            min[axis] = point[axis].min(min[axis]);
            max[axis] = point[axis].max(max[axis]);
        }
    }
    let own = nodes.len();
    nodes.push(Node { min, max, first, end: first + entries.len() as u32, second: 0 });
    if entries.len() <= LEAF || min == max {
        return;
    }
    let side = |axis: usize| max[axis] - min[axis];
    let across = usize::from(side(1) > side(0));
    let longest = if side(2) > side(across) { 2 } else { across };
    let half = entries.len() / 2;
    entries.select_nth_unstable_by(half, |(a, _), (b, _)| a[longest].total_cmp(&b[longest]));
    let (low, high) = entries.split_at_mut(half);
    add_node(nodes, low, first);
    nodes[own].second = nodes.len() as u32;
    add_node(nodes, high, first + half as u32);
}

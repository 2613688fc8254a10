use crate::convex_hull::{ConvexHullScratch, convex_hull_into};

/// A rectangle in the plane, turned in any way.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct OrientedRectangle {
    /// Where its diagonals meet.
    pub center: [f64; 2],
    /// Unit direction of the longer side; its x is positive, or 0 and its y positive.
    pub axis: [f64; 2],
    /// Full lengths along the axis and across it, the longer first; 0 where it has no extent.
    pub lengths: [f64; 2],
}

impl OrientedRectangle {
    /// Product of the two lengths.
    #[inline]
    pub fn area(&self) -> f64 {
        self.lengths[0] * self.lengths[1]
    }

    /// Unit direction of the shorter side: the axis turned left by a right angle.
    #[inline]
    pub fn cross_axis(&self) -> [f64; 2] {
        [-self.axis[1], self.axis[0]]
    }

    /// The four corners, counter-clockwise.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let (along, across) = (self.axis, self.cross_axis());
        [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[s, t]| {
            let (s, t) = (s * self.lengths[0], t * self.lengths[1]);
            [self.center[0] + s * along[0] + t * across[0], self.center[1] + s * along[1] + t * across[1]]
        })
    }
}

/// The rectangle of least area around points in the plane; `None` when there is no finite point.
///
/// One side of it lies on an edge of the points' convex hull. Among edges with equal areas, the first counts,
/// counter-clockwise from the hull's leftmost (of several, lowest) corner. The rectangle of points on one
/// line has no width; that of points at one place has no length either, and its axis is along x. Points that
/// are not finite or have a coordinate beyond 1e120 are skipped.
///
/// # Algorithm
///
/// Rotating calipers over the [`convex_hull`](crate::convex_hull()): as the edge below the rectangle goes
/// around, so do the corners that touch its three other sides. These corners are advanced by the directions
/// of edges rather than by comparing distances, so that corners closer to each other than rounding do not
/// stop them. O(h) for the h corners of the hull, after the hull.
///
/// Freeman, Shapira: "Determining the minimum-area encasing rectangle for an arbitrary closed curve",
/// Communications of the ACM 18, 1975; Toussaint: "Solving geometric problems with the rotating calipers",
/// IEEE MELECON 1983. The paper's footprint correction (eq. 7, 8).
///
/// ```
/// use dymlm_geometry::minimum_area_rectangle;
///
/// // A square on its corner: its bounding box along x and y has twice the area.
/// let rectangle = minimum_area_rectangle(&[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]).expect("finite points");
/// assert!((rectangle.area() - 2.0).abs() < 1e-12);
/// assert!(rectangle.center.iter().all(|x| x.abs() < 1e-12));
/// ```
pub fn minimum_area_rectangle(points: &[[f64; 2]]) -> Option<OrientedRectangle> {
    minimum_area_rectangle_with(points, &mut MinimumAreaRectangleScratch::default())
}

/// [`minimum_area_rectangle`] with a caller's working memory, whose content does not matter: allocates
/// nothing once it has grown.
pub fn minimum_area_rectangle_with(
    points: &[[f64; 2]],
    scratch: &mut MinimumAreaRectangleScratch,
) -> Option<OrientedRectangle> {
    convex_hull_into(points, &mut scratch.convex_hull, &mut scratch.hull);
    around_hull(&scratch.hull)
}

/// Working memory of [`minimum_area_rectangle_with`].
#[derive(Debug, Clone, Default)]
pub struct MinimumAreaRectangleScratch {
    convex_hull: ConvexHullScratch,
    hull: Vec<[f64; 2]>,
}

/// The rectangle around a convex polygon given counter-clockwise.
fn around_hull(hull: &[[f64; 2]]) -> Option<OrientedRectangle> {
    let mut calipers = Calipers::default();
    let encasings = (0..hull.len()).map(|edge| calipers.advance(hull, edge));
    let least = encasings.reduce(|least, next| if next.area < least.area { next } else { least })?;
    Some(least.rectangle())
}

/// The corners that touch the rectangle on the right, above and on the left of the edge below.
#[derive(Default)]
struct Calipers {
    right: usize,
    top: usize,
    left: usize,
}

impl Calipers {
    /// Turns the calipers on to an edge.
    fn advance(&mut self, hull: &[[f64; 2]], edge: usize) -> Encasing {
        // No corner goes around more than once, whatever rounding does to the directions of tiny edges.
        let corner = |index: usize| hull[if index < hull.len() { index } else { index - hull.len() }];
        let side = |index: usize| difference(corner(index + 1), corner(index));
        let last = edge + hull.len();
        let below = side(edge);
        self.right = self.right.max(edge + 1);
        while self.right < last && dot(below, side(self.right)) > 0.0 {
            self.right += 1;
        }
        self.top = self.top.max(self.right);
        while self.top < last && cross(below, side(self.top)) > 0.0 {
            self.top += 1;
        }
        self.left = self.left.max(self.top);
        while self.left < last && dot(below, side(self.left)) < 0.0 {
            self.left += 1;
        }
        let touching = [edge, self.right, self.top, self.left].map(corner);
        Encasing { area: area_on(below, touching), below, touching }
    }
}

/// The area of the rectangle on the edge `below` that touches a corner below, on the right, above and on the
/// left; without a square root, since most rectangles are not the least. Rounding makes no side negative.
fn area_on(below: [f64; 2], touching: [[f64; 2]; 4]) -> f64 {
    let [_, right, top, left] = touching.map(|corner| difference(corner, touching[0]));
    let width_by_edge = (dot(below, right) - dot(below, left).min(0.0)) / dot(below, below);
    width_by_edge * cross(below, top).max(0.0)
}

/// A rectangle that stands on an edge.
struct Encasing {
    area: f64,
    below: [f64; 2],
    /// The corners below, on the right, above, on the left.
    touching: [[f64; 2]; 4],
}

impl Encasing {
    fn rectangle(&self) -> OrientedRectangle {
        let [x, y] = unit(self.below);
        let origin = self.touching[0];
        let [_, right, top, left] = self.touching.map(|corner| difference(corner, origin));
        let ends = [dot([x, y], left).min(0.0), dot([x, y], right)];
        let (width, height) = (ends[1] - ends[0], cross([x, y], top).max(0.0));
        let (along, up) = (f64::midpoint(ends[0], ends[1]), 0.5 * height);
        let center = [origin[0] + along * x - up * y, origin[1] + along * y + up * x];
        let (axis, lengths) =
            if width >= height { ([x, y], [width, height]) } else { ([-y, x], [height, width]) };
        OrientedRectangle { center, axis: to_the_right(axis), lengths }
    }
}

/// The direction or its opposite: with positive x, or zero x and positive y; no -0.
fn to_the_right([x, y]: [f64; 2]) -> [f64; 2] {
    let [x, y] = if x < 0.0 || (x == 0.0 && y < 0.0) { [-x, -y] } else { [x, y] };
    [x + 0.0, y + 0.0]
}

fn difference(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The direction of a vector; the x axis when it has none.
fn unit(a: [f64; 2]) -> [f64; 2] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { [a[0] / length, a[1] / length] } else { [1.0, 0.0] }
}

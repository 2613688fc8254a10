//! Convex hulls in the plane: [`convex_hull`].

mod graham_scan;
mod inner_columns;
mod orientation;
mod outline;

use graham_scan::graham_scan;
use inner_columns::InnerColumns;
use outline::Outline;

/// Points with a coordinate greater than this are passed over: the exact orientation test would overflow.
const FARTHEST: f64 = 1e120;

/// From so many points on, most are worth being recognized as inner ones first.
const FEW: usize = 512;

/// Each so many-th point is looked at for the outline.
const SAMPLING: usize = 16;

/// The vertices of the convex hull of points in the plane, counter-clockwise from the leftmost (of several, the
/// lowest).
///
/// Every vertex is a strict corner: points on an edge and repeated points are left out. The hull of points on one
/// line is its two ends, that of one place a single vertex, that of nothing is empty. Points that are not finite
/// or have a coordinate beyond 1e120 are passed over. All decisions are exact (coordinates between 1e-120 and
/// 1e120 in magnitude, or 0), so no rounding ever drops a corner or keeps a dent.
///
/// # Algorithm
///
/// Graham's scan as Andrew orders it: points by x, then y; the lower chain on the way out, the upper chain on the
/// way back, each popping the corners that do not turn left. Of many points most lie well within the hull of a few,
/// here of the outline of a sample; one pass drops them, by a table over x of what is surely inside. O(n log n) at
/// worst, O(n) when few points lie near the hull, as in scans of things.
///
/// Graham: "An efficient algorithm for determining the convex hull of a finite planar set", Information Processing
/// Letters 1, 1972; Andrew: "Another efficient algorithm for convex hulls in two dimensions", Information
/// Processing Letters 9, 1979. Dropping inner points first: Akl, Toussaint: "A fast convex hull algorithm",
/// Information Processing Letters 7, 1978.
///
/// ```
/// use dymlm_geometry::convex_hull;
///
/// let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]];
/// assert_eq!(convex_hull(&points), [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
/// ```
pub fn convex_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut hull = Vec::new();
    convex_hull_into(points, &mut ConvexHullScratch::new(), &mut hull);
    hull
}

/// [`convex_hull`] into a caller's buffers, whose content does not matter: allocates nothing once they have grown.
pub fn convex_hull_into(points: &[[f64; 2]], scratch: &mut ConvexHullScratch, hull: &mut Vec<[f64; 2]>) {
    let ConvexHullScratch { candidates, outline, columns } = scratch;
    if points.len() < FEW {
        candidates.clear();
        candidates.extend(points.iter().filter_map(usable));
        return graham_scan(candidates, hull);
    }
    outline.trace(points.iter().step_by(SAMPLING).filter_map(usable), candidates);
    graham_scan(candidates, hull);
    candidates.clear();
    if columns.fill(hull) {
        candidates.extend(points.iter().filter(|point| !columns.contain(point)).filter_map(usable));
    } else {
        candidates.extend(points.iter().filter_map(usable));
    }
    graham_scan(candidates, hull);
}

/// Working memory of [`convex_hull_into`].
#[derive(Debug, Clone, Default)]
pub struct ConvexHullScratch {
    candidates: Vec<[f64; 2]>,
    outline: Outline,
    columns: InnerColumns,
}

impl ConvexHullScratch {
    /// Empty working memory.
    pub fn new() -> Self {
        Self::default()
    }
}

/// The point, with 0 for -0, unless it is to be passed over.
#[inline]
fn usable(point: &[f64; 2]) -> Option<[f64; 2]> {
    // NaN fails the comparison.
    let near = point[0].abs() <= FARTHEST && point[1].abs() <= FARTHEST;
    near.then(|| [point[0] + 0.0, point[1] + 0.0])
}

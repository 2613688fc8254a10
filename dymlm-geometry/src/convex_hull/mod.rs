//! Convex hulls in the plane: [`convex_hull`].

mod graham_scan;
mod inner_columns;
mod inner_ellipse;
mod inner_region;
mod left_to_right;
mod outline;
mod usable;

use graham_scan::graham_scan;
use inner_columns::COLUMNS;
use inner_region::InnerRegion;
use left_to_right::LeftToRight;
use outline::Outline;
use usable::usable;

/// With this many points or more, dropping inner points first is faster than sorting them all.
const FEW: usize = 512;

/// With this many points or more the outline is that of a sample, the first `SAMPLE` of every `SPAN` points:
/// neighbours share a line of the cache.
const MANY_POINTS: usize = 8192;
const SPAN: usize = 256;
const SAMPLE: usize = 4;

/// Mean number of points in a column of the outline of few points; lower bound of the number of columns.
const IN_COLUMN: usize = 32;
const FEWEST_COLUMNS: usize = 16;

/// Points are compared with the hull of earlier points in blocks of this many; after each block the hull may
/// be computed again.
const BLOCK: usize = 1024;

/// The hull is computed again when there are more candidates than `MANY` plus `MANY_FOR_CORNER` for each of
/// its corners. So all computations together cost little more than the last one.
const MANY: usize = 128;
const MANY_FOR_CORNER: usize = 3;

/// The vertices of the convex hull of points in the plane, counter-clockwise from the leftmost (of several,
/// the lowest).
///
/// Every vertex is a strict corner: points on an edge and repeated points are left out. The hull of points on
/// one line is its two ends, that of one place a single vertex, that of nothing is empty. Points that are not
/// finite or have a coordinate beyond 1e120 are skipped. All decisions are exact (coordinates between 1e-120
/// and 1e120 in magnitude, or 0), so no rounding ever drops a corner or keeps a dent.
///
/// # Algorithm
///
/// Graham's scan in Andrew's order: points by x, then y; the lower chain on the way out, the upper chain on
/// the way back, each popping the corners that do not turn left. Most of many points lie well within the hull
/// of a few: of the outline of all points, or of a sample. One pass drops the points that are surely inside,
/// and computes the hull again when many others have been found. O(n log n) at worst, O(n) when few points
/// lie near the hull, as in scans of objects.
///
/// Graham: "An efficient algorithm for determining the convex hull of a finite planar set", Information
/// Processing Letters 1, 1972; Andrew: "Another efficient algorithm for convex hulls in two dimensions",
/// Information Processing Letters 9, 1979. Dropping inner points first: Akl, Toussaint: "A fast convex hull
/// algorithm", Information Processing Letters 7, 1978.
///
/// ```
/// use dymlm_geometry::convex_hull;
///
/// let points = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [0.0, 0.0]];
/// assert_eq!(convex_hull(&points), [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
/// ```
pub fn convex_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut hull = Vec::new();
    convex_hull_into(points, &mut ConvexHullScratch::default(), &mut hull);
    hull
}

/// [`convex_hull`] into a caller's buffers, whose content does not matter: allocates nothing once they have
/// grown.
pub fn convex_hull_into(points: &[[f64; 2]], scratch: &mut ConvexHullScratch, hull: &mut Vec<[f64; 2]>) {
    let ConvexHullScratch { candidates, outline, inner, left_to_right } = scratch;
    let mut scan = |candidates: &mut Vec<[f64; 2]>, hull: &mut Vec<[f64; 2]>| {
        left_to_right.sort(candidates);
        graham_scan(candidates, hull);
    };
    candidates.clear();
    if points.len() < FEW {
        candidates.extend(points.iter().filter_map(usable));
        return scan(candidates, hull);
    }
    let columns = (points.len() / IN_COLUMN).clamp(FEWEST_COLUMNS, COLUMNS);
    if points.len() < MANY_POINTS {
        outline.trace(points.iter(), columns, candidates);
    } else {
        let sample = points.chunks(SPAN).flat_map(|span| span.iter().take(SAMPLE));
        outline.trace(sample, columns, candidates);
    }
    scan(candidates, hull);
    inner.fill(hull, columns);
    for block in points.chunks(BLOCK) {
        inner.add_outer(block, candidates);
        if candidates.len() > MANY + MANY_FOR_CORNER * hull.len() {
            scan(candidates, hull);
            candidates.clone_from(hull);
            inner.fill(hull, columns);
        }
    }
    scan(candidates, hull);
}

/// Working memory of [`convex_hull_into`].
#[derive(Debug, Clone, Default)]
pub struct ConvexHullScratch {
    candidates: Vec<[f64; 2]>,
    outline: Outline,
    inner: InnerRegion,
    left_to_right: LeftToRight,
}

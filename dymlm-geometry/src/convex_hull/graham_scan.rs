use robust::{Coord, orient2d};

/// The hull of points from left to right; see [`convex_hull`](super::convex_hull).
pub(super) fn graham_scan(points: &[[f64; 2]], hull: &mut Vec<[f64; 2]>) {
    hull.clear();
    for &point in points {
        append(hull, 0, point);
    }
    // The rightmost point ends the lower chain and begins the upper one.
    let lower = hull.len().saturating_sub(1);
    for point in points.iter().rev() {
        append(hull, lower, *point);
    }
    // The upper chain ends where the lower one began.
    if hull.len() > 1 {
        hull.pop();
    }
}

/// Adds a point to the chain that begins at `start`, and removes the corners that are corners no longer.
fn append(hull: &mut Vec<[f64; 2]>, start: usize, point: [f64; 2]) {
    if hull.last() == Some(&point) {
        return;
    }
    while let [.., before, corner] = hull[start..]
        && !turns_left(before, corner, point)
    {
        hull.pop();
    }
    hull.push(point);
}

/// Whether the path a -> b -> c turns to the left (counter-clockwise); exact.
#[inline]
fn turns_left(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> bool {
    let [a, b, c] = [a, b, c].map(|[x, y]| Coord { x, y });
    orient2d(a, b, c) > 0.0
}

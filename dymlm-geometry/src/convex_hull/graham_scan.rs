use std::cmp::Ordering;

use super::orientation::orientation;

/// The hull of finite points, which are put into order; see [`convex_hull`](super::convex_hull).
pub(super) fn graham_scan(points: &mut [[f64; 2]], hull: &mut Vec<[f64; 2]>) {
    points.sort_unstable_by(left_to_right);
    hull.clear();
    for point in points.iter() {
        append(hull, 0, *point);
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

fn left_to_right(a: &[f64; 2], b: &[f64; 2]) -> Ordering {
    // Finite numbers are comparable.
    a[0].partial_cmp(&b[0])
        .unwrap_or(Ordering::Equal)
        .then(a[1].partial_cmp(&b[1]).unwrap_or(Ordering::Equal))
}

/// Adds a point to the chain that begins at `start`, and takes out the corners that then are none.
fn append(hull: &mut Vec<[f64; 2]>, start: usize, point: [f64; 2]) {
    if hull.last() == Some(&point) {
        return;
    }
    while let [.., before, corner] = hull[start..]
        && orientation(before, corner, point) != Ordering::Greater
    {
        hull.pop();
    }
    hull.push(point);
}

/// Points with a coordinate of greater magnitude are skipped: the exact orientation test would overflow.
const FARTHEST: f64 = 1e120;

/// The point, with 0 for -0, unless it is to be skipped.
#[inline]
pub(super) fn usable(point: &[f64; 2]) -> Option<[f64; 2]> {
    // NaN fails the comparison.
    let near = point[0].abs() <= FARTHEST && point[1].abs() <= FARTHEST;
    near.then(|| [point[0] + 0.0, point[1] + 0.0])
}

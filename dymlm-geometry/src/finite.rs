use dymlm_core::Point;

/// One test for three coordinates: 0 times x is NaN for NaN and the infinities.
#[inline]
pub(crate) fn is_finite(point: &Point) -> bool {
    (0.0 * point[0] + 0.0 * point[1] + 0.0 * point[2]) == 0.0
}

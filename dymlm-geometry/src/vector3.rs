//! More arithmetic on vectors than [`dymlm_core::vector3`] has.

use dymlm_core::vector3::Vector3;

/// `s` a + `t` b.
#[inline]
pub(crate) fn combined(s: f64, a: Vector3, t: f64, b: Vector3) -> Vector3 {
    [s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]]
}

/// The vector or its opposite: whose component of greatest magnitude, the first such, is positive.
#[inline]
pub(crate) fn with_positive_greatest(a: Vector3) -> Vector3 {
    let [x, y, z] = a.map(f64::abs);
    let greatest = if x >= y && x >= z {
        a[0]
    } else if y >= z {
        a[1]
    } else {
        a[2]
    };
    if greatest < 0.0 { a.map(|x| -x) } else { a }
}

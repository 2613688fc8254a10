//! Arithmetic on `[f64; 3]`.

pub(crate) type Vector3 = [f64; 3];

#[inline]
pub(crate) fn dot(a: Vector3, b: Vector3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
pub(crate) fn cross(a: Vector3, b: Vector3) -> Vector3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
pub(crate) fn norm(a: Vector3) -> f64 {
    dot(a, a).sqrt()
}

/// `s` a + `t` b.
#[inline]
pub(crate) fn combined(s: f64, a: Vector3, t: f64, b: Vector3) -> Vector3 {
    [s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]]
}

/// The vector of length 1 in the direction of `a`, which must not be zero.
#[inline]
pub(crate) fn unit(a: Vector3) -> Vector3 {
    let length = norm(a);
    [a[0] / length, a[1] / length, a[2] / length]
}

/// A unit vector across the unit vector `a`.
#[inline]
pub(crate) fn any_across(a: Vector3) -> Vector3 {
    if a[0].abs() > a[1].abs() { unit([-a[2], 0.0, a[0]]) } else { unit([0.0, a[2], -a[1]]) }
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

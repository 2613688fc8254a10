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
pub(crate) fn difference(a: Vector3, b: Vector3) -> Vector3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + `scale` b.
#[inline]
pub(crate) fn along(a: Vector3, scale: f64, b: Vector3) -> Vector3 {
    [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]]
}

#[inline]
pub(crate) fn norm(a: Vector3) -> f64 {
    dot(a, a).sqrt()
}

/// The vector of length 1 in the direction of `a`; `None` when it has none.
#[inline]
pub(crate) fn unit(a: Vector3) -> Option<Vector3> {
    let length = norm(a);
    (length > 1e-12 && length.is_finite()).then(|| a.map(|x| x / length))
}

/// A unit vector across the unit vector `a`.
#[inline]
pub(crate) fn any_across(a: Vector3) -> Vector3 {
    let [x, y, z] = a;
    let across = if x.abs() > y.abs() { [-z, 0.0, x] } else { [0.0, z, -y] };
    let length = norm(across);
    across.map(|c| c / length)
}

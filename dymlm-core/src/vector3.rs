//! Arithmetic on vectors of three `f64`, which have no type of their own here: positions, directions,
//! normals.
//!
//! ```
//! use dymlm_core::vector3::{along, cross, difference, norm, unit};
//!
//! let (a, b) = ([1.0, 0.0, 0.0], [1.0, 2.0, 0.0]);
//! assert_eq!(unit(difference(b, a)), Some([0.0, 1.0, 0.0]));
//! assert_eq!(cross(a, b), [0.0, 0.0, 2.0]);
//! assert_eq!(norm(along(a, -1.0, a)), 0.0);
//! ```

/// A vector of three `f64`.
pub type Vector3 = [f64; 3];

/// Scalar product.
#[inline]
pub fn dot(a: Vector3, b: Vector3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
#[inline]
pub fn cross(a: Vector3, b: Vector3) -> Vector3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a - b.
#[inline]
pub fn difference(a: Vector3, b: Vector3) -> Vector3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// a + `scale` b.
#[inline]
pub fn along(a: Vector3, scale: f64, b: Vector3) -> Vector3 {
    [a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]]
}

/// `s` a + `t` b.
#[inline]
pub fn combined(s: f64, a: Vector3, t: f64, b: Vector3) -> Vector3 {
    [s * a[0] + t * b[0], s * a[1] + t * b[1], s * a[2] + t * b[2]]
}

/// The vector or its opposite, so that its component of greatest magnitude (the first of equal ones) is
/// positive.
#[inline]
pub fn with_positive_greatest(a: Vector3) -> Vector3 {
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

/// Length.
#[inline]
pub fn norm(a: Vector3) -> f64 {
    dot(a, a).sqrt()
}

/// The vector of length 1 in the direction of `a`; `None` when `a` is no longer than 1e-12 or not finite.
#[inline]
pub fn unit(a: Vector3) -> Option<Vector3> {
    let length = norm(a);
    (length > 1e-12 && length.is_finite()).then(|| a.map(|x| x / length))
}

/// A unit vector across the unit vector `a`.
#[inline]
pub fn any_across(a: Vector3) -> Vector3 {
    let [x, y, z] = a;
    let across = if x.abs() > y.abs() { [-z, 0.0, x] } else { [0.0, z, -y] };
    let length = norm(across);
    across.map(|c| c / length)
}

/// The box around points, lowest and highest corner; from infinity to minus infinity when there are none.
pub fn bounds(points: impl IntoIterator<Item = Vector3>) -> [Vector3; 2] {
    let nothing = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.into_iter().fold(nothing, |[low, high], point| {
        let join = |axis: usize| (low[axis].min(point[axis]), high[axis].max(point[axis]));
        let [x, y, z] = [join(0), join(1), join(2)];
        [[x.0, y.0, z.0], [x.1, y.1, z.1]]
    })
}

/// Whether two boxes, each its lowest and highest corner, share any point, those of their surfaces included.
#[inline]
pub fn boxes_touch([low, high]: [Vector3; 2], [other_low, other_high]: [Vector3; 2]) -> bool {
    (0..3).all(|axis| low[axis] <= other_high[axis] && high[axis] >= other_low[axis])
}

/// Distance from a place to the nearest and to the farthest point of a box, given by its lowest and highest
/// corner.
pub fn distances_to_box(place: Vector3, [low, high]: [Vector3; 2]) -> [f64; 2] {
    let nearest = [0, 1, 2].map(|axis| (low[axis] - place[axis]).max(place[axis] - high[axis]).max(0.0));
    let farthest = [0, 1, 2].map(|axis| (place[axis] - low[axis]).max(high[axis] - place[axis]));
    [norm(nearest), norm(farthest)]
}

/// The distances at which a ray enters and leaves a box (lowest and highest corner), in lengths of its
/// direction, 0 where it begins in the box; `None` when it misses the box or begins nowhere.
pub fn crossing(origin: Vector3, direction: Vector3, [low, high]: [Vector3; 2]) -> Option<[f64; 2]> {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        if !origin[axis].is_finite() {
            return None;
        }
        let ends = [low, high].map(|end| end[axis] - origin[axis]);
        if direction[axis] == 0.0 {
            if ends[0] > 0.0 || ends[1] < 0.0 {
                return None;
            }
            continue;
        }
        let [a, b] = ends.map(|end| end / direction[axis]);
        (enter, leave) = (enter.max(a.min(b)), leave.min(a.max(b)));
    }
    (enter <= leave).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_crosses_a_box_between_its_sides() {
        let cube = [[0.0; 3], [2.0; 3]];
        assert_eq!(crossing([-1.0, 1.0, 1.0], [1.0, 0.0, 0.0], cube), Some([1.0, 3.0]));
        assert_eq!(crossing([1.0, 1.0, 1.0], [0.0, -0.5, 0.0], cube), Some([0.0, 2.0]));
        assert_eq!(crossing([-1.0, -1.0, 1.0], [1.0, 1.0, 0.0], cube), Some([1.0, 3.0]));
        assert_eq!(crossing([-1.0, 3.0, 1.0], [1.0, 0.0, 0.0], cube), None, "beside it");
        assert_eq!(crossing([3.0, 1.0, 1.0], [1.0, 0.0, 0.0], cube), None, "behind the ray");
        assert_eq!(crossing([f64::NAN, 1.0, 1.0], [1.0, 0.0, 0.0], cube), None);
    }

    #[test]
    fn a_box_is_as_near_as_its_surface_and_as_far_as_its_corner() {
        let cube = [[0.0; 3], [2.0; 3]];
        assert_eq!(distances_to_box([1.0; 3], cube), [0.0, 3.0_f64.sqrt()]);
        assert_eq!(distances_to_box([1.0, 5.0, 1.0], cube), [3.0, 27.0_f64.sqrt()]);
        assert_eq!(distances_to_box([-3.0, -4.0, 2.0], cube), [5.0, 65.0_f64.sqrt()]);
    }

    #[test]
    fn what_is_across_is_a_unit_vector_at_a_right_angle() {
        for a in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.36, 0.48, 0.8]] {
            let across = any_across(a);
            assert!(dot(a, across).abs() < 1e-15 && (norm(across) - 1.0).abs() < 1e-15, "{across:?}");
        }
    }

    #[test]
    fn boxes_touch_when_they_share_a_point() {
        let [a, b] = [[[0.0; 3], [1.0; 3]], bounds([[1.0, 2.0, 0.2], [3.0, 0.5, 0.1]])];
        assert_eq!(b, [[1.0, 0.5, 0.1], [3.0, 2.0, 0.2]]);
        assert!(boxes_touch(a, b) && boxes_touch(b, a));
        assert!(!boxes_touch(a, [[1.1, 0.5, 0.1], [3.0, 2.0, 0.2]]) && !boxes_touch(a, bounds([])));
    }

    #[test]
    fn what_has_no_direction_has_no_unit() {
        for a in [[0.0; 3], [1e-13, 0.0, 0.0], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0], [1e200; 3]] {
            assert_eq!(unit(a), None);
        }
        assert_eq!(unit([0.0, -2.0, 0.0]), Some([0.0, -1.0, 0.0]));
    }
}

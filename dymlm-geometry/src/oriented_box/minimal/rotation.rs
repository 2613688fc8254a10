use dymlm_core::vector3::{Vector3, dot};

/// Three axes at right angles.
pub(super) type Axes = [Vector3; 3];

/// The axes turned about a vector, by twice the arc tangent of half its length: to first order by its length.
/// No functions are used that differ between machines.
pub(super) fn turned(axes: &Axes, by: Vector3) -> Axes {
    let rotation = rotation(by.map(|x| 0.5 * x));
    axes.map(|axis| rotation.map(|row| dot(row, axis)))
}

/// The rotation matrix of the quaternion (x, y, z, 1), not of unit length.
pub(super) fn rotation([x, y, z]: Vector3) -> [Vector3; 3] {
    let double = 2.0 / (1.0 + x * x + y * y + z * z);
    [
        [1.0 - double * (y * y + z * z), double * (x * y - z), double * (x * z + y)],
        [double * (x * y + z), 1.0 - double * (x * x + z * z), double * (y * z - x)],
        [double * (x * z - y), double * (y * z + x), 1.0 - double * (x * x + y * y)],
    ]
}

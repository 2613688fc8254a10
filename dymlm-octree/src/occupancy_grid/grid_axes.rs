use dymlm_core::Pose;
use dymlm_core::vector3::norm;

use crate::Error;

/// The world's axes after the smallest rotation that takes z to `up`; `None` when `up` has no direction.
pub(super) fn grid_axes(up: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    // Scaled first: squares of large or small components would not be representable.
    let largest = up.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let up = up.map(|value| value / largest);
    let length = norm(up);
    // Zero, infinity and NaN give a length of NaN.
    if !length.is_finite() {
        return None;
    }
    let [x, y, z] = up.map(|value| value / length);
    if z < -1.0 + 1e-9 {
        // Half a turn about any axis across z is equally short: about x, here.
        return Some([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
    }
    // Rodrigues' formula for the rotation about z x up.
    let k = 1.0 / (1.0 + z);
    Some([[1.0 - k * x * x, -k * x * y, -x], [-k * x * y, 1.0 - k * y * y, -y], [x, y, z]])
}

pub(super) fn world_from_grid(axes: [[f64; 3]; 3]) -> Result<Pose, Error> {
    let rows = std::array::from_fn(|row| std::array::from_fn(|column| axes[column][row]));
    Ok(Pose::from_rotation_matrix(rows, [0.0; 3])?)
}

#[cfg(test)]
mod tests {
    use dymlm_core::vector3::dot;

    use super::*;

    #[test]
    fn axes_are_a_rotation_with_up_as_z() {
        for up in [[0.0, 0.0, 2.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [0.3, -0.5, 0.1], [1e-7, 0.0, -1.0]] {
            let axes = grid_axes(up).unwrap();
            for (i, a) in axes.iter().enumerate() {
                for (j, b) in axes.iter().enumerate() {
                    assert!((dot(*a, *b) - f64::from(u8::from(i == j))).abs() < 1e-6, "{up:?}");
                }
            }
            assert!((dot(axes[2], up) - dot(up, up).sqrt()).abs() < 1e-6);
            assert!(world_from_grid(axes).is_ok(), "{up:?}");
        }
        for (tiny, huge) in [(1e-200, 1e200), (1e-320, f64::MAX)] {
            assert_eq!(grid_axes([0.0, 0.0, tiny]), grid_axes([0.0, 0.0, 1.0]));
            assert_eq!(grid_axes([0.0, huge, huge]), grid_axes([0.0, 1.0, 1.0]));
        }
        assert_eq!(grid_axes([0.0; 3]), None);
        assert_eq!(grid_axes([f64::INFINITY, 0.0, 1.0]), None);
        assert_eq!(grid_axes([f64::NAN, 0.0, 1.0]), None);
    }
}

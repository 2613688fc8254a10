use dymlm_core::vector3::{cross, dot};
use dymlm_geometry::OrientedBox;

use crate::YawSymmetry;

/// Angle about the true box's z axis between the two boxes, degrees, modulo the symmetry; `None` for round
/// things.
pub(super) fn yaw_error_degrees(
    estimate: &OrientedBox,
    truth: &OrientedBox,
    symmetry: YawSymmetry,
) -> Option<f64> {
    let axes = |own: &OrientedBox| {
        let rows = own.world_from_box().rotation_matrix();
        [0, 1, 2].map(|axis| rows.map(|row| row[axis]))
    };
    let (true_axes, own_axes) = (axes(truth), axes(estimate));
    let up = true_axes[2];
    let [length, width, _] = truth.lengths();
    let long = true_axes[usize::from(width > length)];
    let own_long = own_axes[longer_horizontal(&own_axes, estimate.lengths(), up)];
    let sine = dot(up, cross(long, own_long));
    let turn = sine.atan2(dot(long, own_long)).to_degrees().rem_euclid(180.0);
    let period = match symmetry {
        YawSymmetry::HalfTurn => 180.0,
        YawSymmetry::QuarterTurn => 90.0,
        YawSymmetry::Full => return None,
    };
    let turn = turn % period;
    Some(turn.min(period - turn))
}

/// Of the two axes furthest from the vertical, the one along which the box is longer.
fn longer_horizontal(axes: &[[f64; 3]; 3], lengths: [f64; 3], up: [f64; 3]) -> usize {
    let upright = |axis: usize| dot(axes[axis], up).abs();
    let mut vertical = 2;
    for axis in [1, 0] {
        // Only by more than rounding errors, so that the choice does not depend on them.
        if upright(axis) > upright(vertical) + 1e-9 {
            vertical = axis;
        }
    }
    let [a, b] = [(vertical + 1) % 3, (vertical + 2) % 3];
    if lengths[b] > lengths[a] { b } else { a }
}

use dymlm_core::vector3::Vector3;

use super::rotation::{Axes, rotation};

/// Rotations from which boxes are searched: a lattice of Rodrigues vectors (axis times the tangent of half
/// the angle) over all boxes that differ. Beyond an eighth of a turn about an axis, or a sixth of a turn
/// about a diagonal, the boxes are the same with their sides in another order.
pub(super) struct StartRotations {
    /// Number of steps from no rotation to an eighth of a turn.
    steps: i8,
}

/// Steps of some 15 degrees.
pub(super) const START_ROTATIONS: StartRotations = StartRotations { steps: 3 };

/// tan(pi / 8).
const EIGHTH_OF_A_TURN: f64 = std::f64::consts::SQRT_2 - 1.0;

impl StartRotations {
    /// The axes of each rotation; successive rotations are neighbours.
    pub(super) fn axes(&self) -> impl Iterator<Item = Axes> {
        let steps = self.steps;
        let step = EIGHTH_OF_A_TURN / f64::from(steps);
        // Every other row goes backwards.
        let row =
            move |row: i8| (-steps..=steps).map(move |at| if (row + steps) % 2 == 0 { at } else { -at });
        let places =
            (-steps..=steps).flat_map(move |x| row(x).flat_map(move |y| row(x + y).map(move |z| [x, y, z])));
        let vectors = places.map(move |place| place.map(|at| step * f64::from(at)));
        vectors.filter(|vector: &Vector3| vector.iter().map(|x| x.abs()).sum::<f64>() <= 1.0).map(rotation)
    }
}

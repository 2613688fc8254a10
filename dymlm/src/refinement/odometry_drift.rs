use std::ops::Range;

use dymlm_core::Pose;
use dymlm_core::vector3::{Vector3, dot};

/// How far poses may have drifted, in standard deviations of the odometry.
pub(super) const REACH: f64 = 3.0;

/// How far odometry may have drifted between two key frames. Holds prefix sums over the steps, so that a
/// query costs the same however many steps are between.
pub(super) struct OdometryDrift {
    before: Vec<Sums>,
}

/// Uncertainty of a place that one key frame sees, relative to another key frame.
pub(super) struct Drift {
    /// Covariance of the place, square metres: a turn of the camera moves places that are far from it.
    pub(super) translation: [[f64; 3]; 3],
    /// Variance of the rotation about one axis, square radians.
    pub(super) rotation: f64,
}

/// Sums over steps.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Variance of the translation along one axis.
    translation: f64,
    /// Variance of the rotation about one axis.
    rotation: f64,
    /// Variance of the rotation, times the place at which the camera turned, metres, world.
    places: Vector3,
    /// Variance of the rotation, times the products of that place's coordinates.
    products: [[f64; 3]; 3],
}

impl OdometryDrift {
    /// `poses`: those of the key frames; `steps`: the standard deviations of the rotation and the
    /// translation, of one axis, from each key frame to the next.
    pub(super) fn new(poses: &[Pose], steps: impl Iterator<Item = [f64; 2]>) -> Self {
        let mut before = vec![Sums::default()];
        for (pose, [rotation, translation]) in poses.iter().zip(steps) {
            let mut sums = before[before.len() - 1];
            let (variance, place) = (rotation * rotation, pose.translation());
            sums.translation += translation * translation;
            sums.rotation += variance;
            for row in 0..3 {
                sums.places[row] += variance * place[row];
                for column in 0..3 {
                    sums.products[row][column] += variance * place[row] * place[column];
                }
            }
            before.push(sums);
        }
        Self { before }
    }

    /// Drift of a place (metres, world) that a key frame sees, since the first key frame.
    pub(super) fn before(&self, key_frame: usize, place: Vector3) -> Drift {
        self.between(0..key_frame, place)
    }

    /// Drift of a place that the key frame at the range's end sees, since the one at its start.
    pub(super) fn between(&self, key_frames: Range<usize>, place: Vector3) -> Drift {
        let none = Sums::default();
        let [first, last] =
            [key_frames.start, key_frames.end].map(|index| self.before.get(index).unwrap_or(&none));
        let rotation = last.rotation - first.rotation;
        let places: Vector3 = std::array::from_fn(|axis| last.places[axis] - first.places[axis]);
        // Sums of variance times the products of the arms, which lead from where the camera turned to the
        // place.
        let arms = |row: usize, column: usize| {
            let products = last.products[row][column] - first.products[row][column];
            let mixed = places[row] * place[column] + place[row] * places[column];
            products - mixed + rotation * place[row] * place[column]
        };
        // A turn moves the place at right angles to its arm: variance times (|arm|^2 I - arm arm^T).
        let squared = arms(0, 0) + arms(1, 1) + arms(2, 2);
        let own = last.translation - first.translation + squared;
        let entry = |row: usize, column: usize| if row == column { own } else { 0.0 } - arms(row, column);
        Drift { translation: [0, 1, 2].map(|row| [0, 1, 2].map(|column| entry(row, column))), rotation }
    }
}

/// The variance along a unit vector.
pub(super) fn quadratic(covariance: &[[f64; 3]; 3], direction: Vector3) -> f64 {
    dot(direction, covariance.map(|row| dot(row, direction)))
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;
    use dymlm_core::vector3::{cross, difference};

    use super::*;

    #[test]
    fn sums_are_those_of_the_steps() {
        let mut random = SplitMix64::new(3);
        let mut vector = || [(); 3].map(|()| 4.0 * random.fraction() - 2.0);
        let poses: Vec<Pose> = (0..9).map(|_| Pose::new(vector(), [0.0, 0.0, 0.0, 1.0]).unwrap()).collect();
        let deviations = |step: usize| [0.01 * (1.0 + step as f64), 0.02 * (9.0 - step as f64)];
        let drift = OdometryDrift::new(&poses, (0..8).map(deviations));
        for _ in 0..20 {
            let (place, direction) = (vector(), vector());
            let step = |step: usize| {
                let [rotation, translation] = deviations(step);
                let arm = cross(difference(place, poses[step].translation()), direction);
                translation * translation * dot(direction, direction) + rotation * rotation * dot(arm, arm)
            };
            let expected: f64 = (2..7).map(step).sum();
            let found = quadratic(&drift.between(2..7, place).translation, direction);
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        assert!((drift.between(7..8, [0.0; 3]).rotation - 0.0064).abs() < 1e-12);
        assert!(drift.before(0, [0.0; 3]).rotation == 0.0);
    }
}

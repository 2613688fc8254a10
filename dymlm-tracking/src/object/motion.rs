use dymlm_core::Pose;

use crate::pose::rotation_about;

/// A motion is believed to go on for so long, seconds.
const LONGEST_PREDICTION: f64 = 0.2;

/// Where the object will be, if it goes on as it went.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    last: Pose,
    time: f64,
    /// Metres a second and radians a second about the world's axes.
    velocity: [f64; 3],
    spin: [f64; 3],
}

impl Motion {
    pub(super) fn at_rest(pose: Pose, time: f64) -> Self {
        Self { last: pose, time, velocity: [0.0; 3], spin: [0.0; 3] }
    }

    /// The last known pose, `world_from_object`.
    pub(super) fn last(&self) -> &Pose {
        &self.last
    }

    pub(super) fn predict(&self, time: f64) -> Pose {
        let dt = (time - self.time).clamp(0.0, LONGEST_PREDICTION);
        let turn = rotation_about(self.spin.map(|w| w * dt));
        let place = self.last.translation();
        let moved = std::array::from_fn(|i| place[i] + self.velocity[i] * dt);
        Pose::new(moved, (turn * self.last).quaternion()).unwrap_or(self.last)
    }

    /// Takes the pose at a later time; after a gap the motion in it is not known.
    pub(super) fn observe(&mut self, pose: &Pose, time: f64) {
        let dt = time - self.time;
        if dt > 1e-6 {
            let is_continuous = dt <= 2.0 * LONGEST_PREDICTION;
            let [from, to] = [self.last.translation(), pose.translation()];
            let rate = if is_continuous { 1.0 / dt } else { 0.0 };
            self.velocity = std::array::from_fn(|i| (to[i] - from[i]) * rate);
            self.spin = turn_between(&self.last, pose).map(|angle| angle * rate);
        }
        (self.last, self.time) = (*pose, time);
    }
}

/// The turn from one pose to another as an axis times an angle, in the frame that both lead to.
fn turn_between(from: &Pose, to: &Pose) -> [f64; 3] {
    let [x, y, z, w] = (*to * from.inverse()).quaternion();
    let sign = if w < 0.0 { -1.0 } else { 1.0 };
    let sine = (x * x + y * y + z * z).sqrt();
    let factor = if sine < 1e-12 { 2.0 } else { 2.0 * sine.atan2(sign * w) / sine };
    [x, y, z].map(|q| sign * q * factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goes_on_as_it_went() {
        let half = |angle: f64| [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()];
        let at = |time: f64| Pose::new([0.3 * time, 0.0, 1.0], half(0.8 * time)).unwrap();
        let mut motion = Motion::at_rest(at(0.0), 0.0);
        motion.observe(&at(0.1), 0.1);
        let predicted = motion.predict(0.2);
        assert!(predicted.distance(&at(0.2)) < 1e-9 && predicted.angle(&at(0.2)) < 1e-6);
        // Not for ever.
        assert!(motion.predict(9.0).distance(&at(0.3)) < 1e-9);
        assert_eq!(motion.predict(0.05), at(0.1));
    }

    #[test]
    fn more_than_half_a_turn_is_taken_the_short_way() {
        let from = Pose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let to = Pose::new([0.0; 3], [0.0, 0.0, -0.1, -(0.99_f64.sqrt())]).unwrap();
        let turn = turn_between(&from, &to);
        assert!((turn[2] - 2.0 * 0.1_f64.asin()).abs() < 1e-9);
    }
}

use dymlm_core::Pose;
use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::pose::{PosePrior, moved, step_between};

/// Standard deviations of a pose that the caller gives, radians and metres.
const GIVEN: [f64; 2] = [0.02, 0.01];
/// Standard deviations of the rates of an object that is found again, radians and metres per second.
const FOUND_RATE: [f64; 2] = [3.0, 1.0];
/// Time for which a motion is extrapolated at least, seconds: frames at 5 Hz, one of them dropped. By then the
/// accelerations say as much as the motion of a hand (0.4 m at 3 m/s^2), and the covariance covers a stop. A
/// lower value lags behind the object at low frame rates while it claims to know the motion.
const GOES_ON: f64 = 0.5;

/// The object's pose and motion: a Kalman filter with random accelerations that are constant between two
/// frames (Bar-Shalom, Li, Kirubarajan 2001, section 6.3.2).
///
/// The prediction is one more observation ([`PosePrior`]) when a frame's pose is fitted. The fitted pose and
/// its covariance replace the filter's, and the rates follow through their correlation with the pose. So
/// directions about which a frame says little (without depth, these are distance and rotation out of the
/// image plane) keep what earlier frames said.
///
/// Vectors of six are rotations about the world's axes, radians, then translations of the origin, metres.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    pose: Pose,
    time: f64,
    rate: Vector6<f64>,
    /// Covariances of the pose, of the rate (rows) with the pose (columns), and of the rate.
    pose_covariance: Matrix6<f64>,
    cross_covariance: Matrix6<f64>,
    rate_covariance: Matrix6<f64>,
    /// Longest time for which a motion is extrapolated, seconds.
    longest: f64,
    /// Standard deviations of the acceleration.
    acceleration: Vector6<f64>,
}

impl Motion {
    /// An object that stands still. The accelerations' standard deviations are in radians and metres per
    /// second squared; `lost_after` is the time without a pose after which the object counts as lost, seconds. Its
    /// motion is extrapolated until then, and into the next frames however soon it counts as lost.
    pub(super) fn at_rest(pose: Pose, time: f64, [angular, linear]: [f64; 2], lost_after: f64) -> Self {
        Self {
            pose,
            time,
            rate: Vector6::zeros(),
            pose_covariance: variances(GIVEN),
            cross_covariance: Matrix6::zeros(),
            rate_covariance: Matrix6::zeros(),
            longest: lost_after.max(GOES_ON),
            acceleration: Vector6::new(angular, angular, angular, linear, linear, linear),
        }
    }

    /// The last known pose, `world_from_object`.
    pub(super) fn last(&self) -> &Pose {
        &self.pose
    }

    /// The pose at a later time, if the object goes on moving as it did.
    pub(super) fn predict(&self, time: f64) -> Pose {
        moved(&self.pose, &(self.rate * (time - self.time).clamp(0.0, self.longest)))
    }

    /// The predicted pose in a camera's frame, with its information matrix.
    pub(super) fn prior(&self, time: f64, world_from_camera: &Pose) -> Option<PosePrior> {
        let camera_from_world = world_from_camera.inverse();
        let covariance = turned(&self.at(time).pose_covariance, &camera_from_world);
        Some(PosePrior {
            camera_from_body: camera_from_world * self.predict(time),
            information: covariance.cholesky()?.inverse(),
        })
    }

    /// Takes the pose of a later frame, fitted with [`prior`](Self::prior), and its covariance in the
    /// camera's frame.
    pub(super) fn observe(
        &mut self,
        pose: &Pose,
        covariance: Option<&[[f64; 6]; 6]>,
        time: f64,
        world_from_camera: &Pose,
    ) {
        let predicted = self.at(time);
        let known = covariance.map_or(predicted.pose_covariance, |c| in_world(c, world_from_camera));
        let gain = predicted.pose_covariance.cholesky().map_or_else(Matrix6::zeros, |root| {
            root.solve(&predicted.cross_covariance.transpose()).transpose()
        });
        let correction = step_between(&predicted.pose, pose);
        *self = Self {
            pose: *pose,
            rate: predicted.rate + gain * correction,
            rate_covariance: predicted.rate_covariance
                + gain * (known - predicted.pose_covariance) * gain.transpose(),
            cross_covariance: gain * known,
            pose_covariance: known,
            ..predicted
        };
    }

    /// Converts everything after the world frame was moved.
    pub(super) fn move_world(&mut self, new_from_old: &Pose) {
        self.pose = *new_from_old * self.pose;
        self.rate = rotations(new_from_old) * self.rate;
        for covariance in [&mut self.pose_covariance, &mut self.cross_covariance, &mut self.rate_covariance] {
            *covariance = turned(covariance, new_from_old);
        }
    }

    /// Notes that the object has stood still until now.
    pub(super) fn stand(&mut self, time: f64) {
        self.time = time;
        self.rate = Vector6::zeros();
        (self.cross_covariance, self.rate_covariance) = (Matrix6::zeros(), Matrix6::zeros());
    }

    /// Takes the pose at which the object was found again; its motion is then unknown.
    pub(super) fn restart(
        &mut self,
        pose: &Pose,
        covariance: Option<&[[f64; 6]; 6]>,
        time: f64,
        world_from_camera: &Pose,
    ) {
        let pose_covariance = covariance.map_or_else(|| variances(GIVEN), |c| in_world(c, world_from_camera));
        *self = Self {
            pose: *pose,
            time,
            rate: Vector6::zeros(),
            pose_covariance,
            cross_covariance: Matrix6::zeros(),
            rate_covariance: variances(FOUND_RATE),
            ..*self
        };
    }

    /// The filter's state, predicted to a later time.
    fn at(&self, time: f64) -> Self {
        let dt = (time - self.time).max(0.0);
        let noise = Matrix6::from_diagonal(&self.acceleration.map(|a| a * a * dt * dt));
        let crossed = self.cross_covariance + self.rate_covariance * dt;
        Self {
            pose: self.predict(time),
            time,
            pose_covariance: self.pose_covariance
                + (crossed + self.cross_covariance.transpose()) * dt
                + noise * (0.25 * dt * dt),
            cross_covariance: crossed + noise * (0.5 * dt),
            rate_covariance: self.rate_covariance + noise,
            ..self.clone()
        }
    }
}

fn variances([angle, place]: [f64; 2]) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::new(angle, angle, angle, place, place, place).map(|sigma| sigma * sigma))
}

fn in_world(covariance: &[[f64; 6]; 6], world_from_camera: &Pose) -> Matrix6<f64> {
    turned(&Matrix6::from_fn(|row, column| covariance[row][column]), world_from_camera)
}

/// A covariance in the axes of another frame.
fn turned(covariance: &Matrix6<f64>, to_from: &Pose) -> Matrix6<f64> {
    let both = rotations(to_from);
    both * covariance * both.transpose()
}

/// The matrix that takes six numbers, rotations and translations, to the axes of another frame.
fn rotations(to_from: &Pose) -> Matrix6<f64> {
    let rows = to_from.rotation_matrix();
    let rotation = Matrix3::from_fn(|row, column| rows[row][column]);
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    const ACCELERATIONS: [f64; 2] = [8.0, 3.0];

    fn at(time: f64) -> Pose {
        let half = 0.4 * time;
        Pose::new([0.3 * time, 0.0, 1.0], [0.0, 0.0, half.sin(), half.cos()]).unwrap()
    }

    /// A filter after `frames` frames at 30 Hz, observed with these standard deviations, radians and metres.
    fn observed(frames: u32, known: [f64; 2], lost_after: f64) -> Motion {
        let covariance = variances(known);
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)]));
        let mut motion = Motion::at_rest(at(0.0), 0.0, ACCELERATIONS, lost_after);
        for frame in 1..=frames {
            let time = f64::from(frame) / 30.0;
            motion.observe(&at(time), Some(&rows), time, &Pose::identity());
        }
        motion
    }

    #[test]
    fn learns_how_the_object_moves_and_goes_on_so() {
        let motion = observed(30, [1e-3, 1e-3], 0.6);
        let predicted = motion.predict(1.1);
        assert!(predicted.distance(&at(1.1)) < 1e-3 && predicted.angle(&at(1.1)) < 1e-3, "{predicted:?}");
        // The motion is not extrapolated for ever.
        assert!(motion.predict(9.0).distance(&at(1.6)) < 2e-3);
    }

    /// The next frame comes after 0.2 s, or 0.4 s after one that was dropped.
    #[test]
    fn a_motion_goes_on_into_the_next_frame_however_soon_the_object_counts_as_lost() {
        for lost_after in [0.0, 0.1, 0.3] {
            let motion = observed(30, [1e-3, 1e-3], lost_after);
            for time in [1.2, 1.4] {
                let predicted = motion.predict(time);
                assert!(predicted.distance(&at(time)) < 2e-3, "{lost_after} s, {time}: {predicted:?}");
                assert!(predicted.angle(&at(time)) < 2e-3, "{lost_after} s, {time}: {predicted:?}");
            }
        }
    }

    #[test]
    fn knows_less_the_longer_it_saw_nothing_and_in_any_frame_alike() {
        let motion = observed(30, [1e-3, 1e-3], 0.6);
        let far = moved(&motion.predict(1.1), &Vector6::new(0.0, 0.0, 0.0, 0.05, 0.0, 0.0));
        let distance = |time: f64, world_from_camera: &Pose| {
            let prior = motion.prior(time, world_from_camera).unwrap();
            prior.squared_distance(&(world_from_camera.inverse() * far))
        };
        let [soon, late] = [1.1, 1.4].map(|time| distance(time, &Pose::identity()));
        assert!(soon > late, "{soon} {late}");
        let turned = Pose::new([0.3, -2.0, 0.1], [0.5, -0.5, 0.5, 0.5]).unwrap();
        assert!((distance(1.1, &turned) / soon - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_pose_found_again_tells_nothing_of_its_motion() {
        let mut motion = observed(30, [1e-3, 1e-3], 0.6);
        motion.restart(&at(3.0), None, 3.0, &Pose::identity());
        assert_eq!(motion.predict(3.1), at(3.0));
        let prior = motion.prior(3.1, &Pose::identity()).unwrap();
        assert!(prior.squared_distance(&at(3.1)) < 1.0);
    }
}

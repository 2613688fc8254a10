use dymlm_core::Pose;
use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::Error;
use crate::lie::{adjoint, log, right_jacobian_inverse};
use crate::pose_conversion::isometry;

/// How one pose is seen from another: odometry between two key frames, or a loop closure.
///
/// Its error is `log(measured^-1 * from^-1 * to)`, six numbers, the rotation's (radians) before the
/// translation's (metres): what GTSAM's `BetweenFactorPose3` takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativePose {
    /// Index of the pose from which it is seen.
    pub from: usize,
    /// Index of the pose that is seen.
    pub to: usize,
    /// `from_from_to`: takes points of `to`'s frame to that of `from`.
    pub measured: Pose,
    /// Inverse covariance of the error, rotation first.
    pub information: [[f64; 6]; 6],
}

impl RelativePose {
    /// A relative pose with independent errors of these standard deviations: radians about each axis, metres
    /// along each.
    pub fn with_deviations(from: usize, to: usize, measured: Pose, rotation: f64, translation: f64) -> Self {
        let weights = [rotation, rotation, rotation, translation, translation, translation];
        let row =
            |k: usize| std::array::from_fn(|l| if k == l { 1.0 / (weights[k] * weights[k]) } else { 0.0 });
        Self { from, to, measured, information: std::array::from_fn(row) }
    }
}

/// A relative pose, prepared for the solver.
#[derive(Debug, Clone)]
pub(crate) struct RelativeFactor {
    pub(crate) poses: [usize; 2],
    inverse: Isometry3<f64>,
    /// A root R of the information: R^T R is the information.
    root: Matrix6<f64>,
}

impl RelativeFactor {
    pub(crate) fn new(relative: &RelativePose, poses: usize) -> Result<Self, Error> {
        let &RelativePose { from, to, measured, information } = relative;
        if let Some(pose) = [from, to].into_iter().find(|&pose| pose >= poses) {
            return Err(Error::UnknownPose { pose, poses });
        }
        if from == to {
            return Err(Error::OwnNeighbour(from));
        }
        let no_information = Error::NoInformation { what: "information of a relative pose" };
        let information = Matrix6::from_fn(|k, l| information[k][l]);
        let size = information.amax();
        let is_symmetric = (information - information.transpose()).amax() <= 1e-6 * size;
        if !information.iter().all(|number| number.is_finite()) || !is_symmetric {
            return Err(no_information);
        }
        let eigen = information.symmetric_eigen();
        if eigen.eigenvalues.iter().any(|&value| value < -1e-9 * size) {
            return Err(no_information);
        }
        let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
        let root = Matrix6::from_diagonal(&roots) * eigen.eigenvectors.transpose();
        Ok(Self { poses: [from, to], inverse: isometry(&measured).inverse(), root })
    }

    /// The error in standard deviations.
    pub(crate) fn error(&self, [from, to]: [&Isometry3<f64>; 2]) -> Vector6<f64> {
        self.root * log(&(self.inverse * from.inverse() * to))
    }

    /// The error, and its derivatives by each of the two poses.
    pub(crate) fn linearized(&self, [from, to]: [&Isometry3<f64>; 2]) -> (Vector6<f64>, [Matrix6<f64>; 2]) {
        let between = from.inverse() * to;
        let error = log(&(self.inverse * between));
        let by_to = self.root * right_jacobian_inverse(&error);
        (self.root * error, [-by_to * adjoint(&between.inverse()), by_to])
    }
}

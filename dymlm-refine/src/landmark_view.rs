use nalgebra::{Isometry3, Matrix3, Matrix3x6, Vector3};

use crate::Error;
use crate::lie::skew;
use crate::view::View;

/// Where a key frame has seen a landmark, such as the centre of an object, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkView {
    /// Index of the pose from which it was seen.
    pub pose: usize,
    /// Where it was seen, metres.
    pub place: [f64; 3],
    /// Covariance of that place, square metres: large along a direction in which the view says little.
    pub covariance: [[f64; 3]; 3],
}

/// A view, prepared for the solver.
#[derive(Debug, Clone)]
pub(crate) struct LandmarkFactor {
    pose: usize,
    place: Vector3<f64>,
    /// The inverse covariance, and a root R of it: R^T R is the information.
    information: Matrix3<f64>,
    root: Matrix3<f64>,
}

/// A variance that is smaller than this share of the largest is only rounding error.
const LEAST_VARIANCE: f64 = 1e-12;

impl LandmarkFactor {
    pub(crate) fn new(view: &LandmarkView, poses: usize) -> Result<Self, Error> {
        let &LandmarkView { pose, place, covariance } = view;
        if pose >= poses {
            return Err(Error::UnknownPose { pose, poses });
        }
        let no_information = Error::NoInformation { what: "covariance of a landmark's place" };
        let covariance = Matrix3::from_fn(|k, l| covariance[k][l]);
        let size = covariance.amax();
        let is_symmetric = (covariance - covariance.transpose()).amax() <= 1e-6 * size;
        if !covariance.iter().chain(&place).all(|number| number.is_finite()) || !is_symmetric {
            return Err(no_information);
        }
        let eigen = covariance.symmetric_eigen();
        let weights = eigen.eigenvalues.map(|variance| 1.0 / variance);
        let is_definite = eigen.eigenvalues.min() > LEAST_VARIANCE * size && weights.amax().is_finite();
        if !is_definite {
            return Err(no_information);
        }
        let axes = eigen.eigenvectors;
        Ok(Self {
            pose,
            place: place.into(),
            information: axes * Matrix3::from_diagonal(&weights) * axes.transpose(),
            root: Matrix3::from_diagonal(&weights.map(f64::sqrt)) * axes.transpose(),
        })
    }
}

impl View<3> for LandmarkFactor {
    /// Its place.
    type Thing = Vector3<f64>;

    fn pose(&self) -> usize {
        self.pose
    }

    /// The landmark's offset, in the camera's frame, from where it was seen, in standard deviations.
    fn error(&self, pose: &Isometry3<f64>, place: &Vector3<f64>) -> Vector3<f64> {
        self.root * (in_camera(pose, place) - self.place)
    }

    fn linearized(
        &self,
        pose: &Isometry3<f64>,
        place: &Vector3<f64>,
    ) -> (Vector3<f64>, Matrix3x6<f64>, Matrix3<f64>) {
        let seen = in_camera(pose, place);
        let mut by_pose = Matrix3x6::zeros();
        by_pose.fixed_view_mut::<3, 3>(0, 0).copy_from(&(self.root * skew(seen)));
        by_pose.fixed_view_mut::<3, 3>(0, 3).copy_from(&-self.root);
        let by_place = self.root * pose.rotation.to_rotation_matrix().matrix().transpose();
        (self.root * (seen - self.place), by_pose, by_place)
    }

    /// The mean of the views, weighted with their information.
    fn best(views: &[Self], poses: &[Isometry3<f64>], weights: &[f64]) -> Option<Vector3<f64>> {
        let counts_all = weights.iter().all(|weight| *weight == 0.0);
        let (mut information, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        let seen_at = |view: &LandmarkFactor| {
            let pose = &poses[view.pose];
            pose.rotation * view.place + pose.translation.vector
        };
        // Relative to the first view, so that no digits are lost far from the origin.
        let origin = views.first().map(seen_at)?;
        for (view, weight) in views.iter().zip(weights) {
            let rotation = *poses[view.pose].rotation.to_rotation_matrix().matrix();
            let own = rotation * view.information * rotation.transpose();
            let own = own * if counts_all { 1.0 } else { *weight };
            information += own;
            pull += own * (seen_at(view) - origin);
        }
        Some(origin + information.cholesky()?.solve(&pull))
    }
}

fn in_camera(pose: &Isometry3<f64>, place: &Vector3<f64>) -> Vector3<f64> {
    pose.rotation.inverse() * (place - pose.translation.vector)
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;
    use nalgebra::Vector6;

    use super::*;
    use crate::lie::exp;

    fn random_view(random: &mut SplitMix64, pose: usize) -> LandmarkView {
        let mut number = || random.fraction() - 0.5;
        let root = Matrix3::from_fn(|_, _| number());
        let covariance = root * root.transpose() + Matrix3::identity() * 0.01;
        LandmarkView {
            pose,
            place: [0; 3].map(|_| 4.0 * number()),
            covariance: std::array::from_fn(|k| std::array::from_fn(|l| covariance[(k, l)])),
        }
    }

    fn random_pose(random: &mut SplitMix64) -> Isometry3<f64> {
        exp(&Vector6::from_fn(|_, _| 2.0 * random.fraction() - 1.0))
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (mut random, step) = (SplitMix64::new(6), 1e-6);
        for _ in 0..20 {
            let view = LandmarkFactor::new(&random_view(&mut random, 0), 1).unwrap();
            let pose = random_pose(&mut random);
            let place = Vector3::from_fn(|_, _| 4.0 * random.fraction() - 2.0);
            let (error, by_pose, by_place) = view.linearized(&pose, &place);
            assert!((error - view.error(&pose, &place)).norm() < 1e-12);
            for k in 0..6 {
                let mut small = Vector6::zeros();
                small[k] = step;
                let [more, less] = [small, -small].map(|small| view.error(&(pose * exp(&small)), &place));
                assert!((by_pose.column(k) - (more - less) / (2.0 * step)).norm() < 1e-7, "pose {k}");
            }
            for k in 0..3 {
                let mut small = Vector3::zeros();
                small[k] = step;
                let [more, less] = [small, -small].map(|small| view.error(&pose, &(place + small)));
                assert!((by_place.column(k) - (more - less) / (2.0 * step)).norm() < 1e-7, "place {k}");
            }
        }
    }

    #[test]
    fn no_other_place_costs_less() {
        let mut random = SplitMix64::new(9);
        for _ in 0..20 {
            let poses = [0; 3].map(|_| random_pose(&mut random));
            let view = |pose| LandmarkFactor::new(&random_view(&mut random, pose), 3).unwrap();
            let seen: Vec<_> = (0..3).map(view).collect();
            let weights = [1.0, 0.3, 0.7];
            let cost = |place: &Vector3<f64>| -> f64 {
                let views = seen.iter().zip(weights);
                views.map(|(v, weight)| weight * v.error(&poses[v.pose], place).norm_squared()).sum()
            };
            let best = LandmarkFactor::best(&seen, &poses, &weights).unwrap();
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                assert!(cost(&(best + axis * 1e-3)).min(cost(&(best - axis * 1e-3))) > cost(&best));
            }
            assert!(LandmarkFactor::best(&seen, &poses, &[0.0; 3]).is_some());
        }
    }

    #[test]
    fn what_is_no_view_is_refused() {
        let view = random_view(&mut SplitMix64::new(1), 0);
        assert_eq!(LandmarkFactor::new(&view, 0).unwrap_err(), Error::UnknownPose { pose: 0, poses: 0 });
        let diagonal =
            |values: [f64; 3]| [0, 1, 2].map(|k| [0, 1, 2].map(|l| if k == l { values[k] } else { 0.0 }));
        for wrong in [
            LandmarkView { place: [f64::INFINITY, 0.0, 0.0], ..view },
            LandmarkView { place: [0.0, f64::NAN, 0.0], ..view },
            LandmarkView { covariance: [[f64::NAN; 3]; 3], ..view },
            LandmarkView { covariance: diagonal([1.0, 0.0, 1.0]), ..view },
            LandmarkView { covariance: diagonal([1.0, 1.0, -1.0]), ..view },
            LandmarkView { covariance: [[0.0; 3]; 3], ..view },
            LandmarkView { covariance: [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..view },
        ] {
            assert!(matches!(LandmarkFactor::new(&wrong, 1), Err(Error::NoInformation { .. })), "{wrong:?}");
        }
    }
}

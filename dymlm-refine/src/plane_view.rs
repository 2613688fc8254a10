use dymlm_core::{Pose, symmetric_eigen3};
use nalgebra::{Isometry3, Matrix3, Matrix3x2, Matrix4, Matrix4x3, Matrix4x6, Vector3, Vector4};

use crate::Error;
use crate::lie::skew;
use crate::pose_conversion::isometry;
use crate::view::View;

/// What a key frame has seen of a plane: the moments of its inliers, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneView {
    /// Index of the pose from which it was seen.
    pub pose: usize,
    /// Weight of the inliers together: the inverse of the variance of their mean distance from the plane, 1 /
    /// m^2.
    pub information: f64,
    /// Mean of the inliers, metres.
    pub centroid: [f64; 3],
    /// Covariance of the inliers, square metres, as xx, xy, xz, yy, yz, zz.
    pub covariance: [f64; 6],
}

/// A view, prepared for the solver.
#[derive(Debug, Clone)]
pub(crate) struct PlaneFactor {
    pose: usize,
    information: f64,
    centroid: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// Transposed root of the covariance: its rows are the axes of the inliers, as long as their standard
    /// deviations.
    spread: Matrix3<f64>,
}

/// A plane in the world: points x with normal . x + offset = 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WorldPlane {
    normal: Vector3<f64>,
    offset: f64,
    /// Two unit vectors within it.
    across: Matrix3x2<f64>,
}

impl PlaneView {
    /// Sum of the squared errors of views, in standard deviations, from the plane that fits `seen` best: the
    /// eigenvector of the least eigenvalue of all its moments (Ferrer, "Eigen-Factors", 2019). `poses` take
    /// the cameras' points to the world; [`pose`](Self::pose) is an index into them. Of n views of one plane
    /// with the noise that they state, the misfit from their own plane is 3 (n - 1) on average; 0 for one or
    /// none.
    ///
    /// ```
    /// use dymlm_core::Pose;
    /// use dymlm_refine::PlaneView;
    ///
    /// // A wall 3 m ahead, and once more 1 m ahead after 2 m of the way, with 1 cm of noise.
    /// let covariance = [0.3, 0.0, 0.0, 0.3, 0.0, 0.0];
    /// let view = |pose, ahead| PlaneView { pose, information: 1e4, centroid: [0.0, 0.0, ahead], covariance };
    /// let poses = [Pose::identity(), Pose::new([0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0])?];
    /// let wall = [view(0, 3.0), view(1, 1.0)];
    /// assert!(PlaneView::misfit(&wall, &wall, &poses)? < 1e-6);
    /// // 10 cm are ten deviations.
    /// assert!((PlaneView::misfit(&[view(1, 1.1)], &wall, &poses)? - 100.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::NoInformation`]; [`Error::Singular`] where numbers are too large, or
    /// when there are views and nothing `seen`.
    pub fn misfit(views: &[Self], seen: &[Self], poses: &[Pose]) -> Result<f64, Error> {
        if views.is_empty() {
            return Ok(0.0);
        }
        let (seen, seen_from) = with_own_poses(seen, poses)?;
        let weights = vec![1.0; seen.len()];
        let plane = PlaneFactor::best(&seen, &seen_from, &weights).ok_or(Error::Singular)?;
        let (views, from) = with_own_poses(views, poses)?;
        Ok(views.iter().zip(&from).map(|(view, pose)| view.error(pose, &plane).norm_squared()).sum())
    }
}

/// Views numbered anew, each with its pose, so that the number of all poses does not matter.
fn with_own_poses(
    views: &[PlaneView],
    poses: &[Pose],
) -> Result<(Vec<PlaneFactor>, Vec<Isometry3<f64>>), Error> {
    let pose_of = |view: &PlaneView| {
        let unknown = Error::UnknownPose { pose: view.pose, poses: poses.len() };
        poses.get(view.pose).map(isometry).ok_or(unknown)
    };
    let own_poses: Vec<_> = views.iter().map(pose_of).collect::<Result<_, _>>()?;
    let factor =
        |(pose, view): (usize, &PlaneView)| PlaneFactor::new(&PlaneView { pose, ..*view }, views.len());
    Ok((views.iter().enumerate().map(factor).collect::<Result<_, _>>()?, own_poses))
}

impl PlaneFactor {
    pub(crate) fn new(view: &PlaneView, poses: usize) -> Result<Self, Error> {
        let &PlaneView { pose, information, centroid, covariance: [xx, xy, xz, yy, yz, zz] } = view;
        if pose >= poses {
            return Err(Error::UnknownPose { pose, poses });
        }
        let no_information = Error::NoInformation { what: "covariance of a plane's inliers" };
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let eigen = symmetric_eigen3(rows).ok_or_else(|| no_information.clone())?;
        let [largest, _, least] = eigen.values;
        let is_right = information > 0.0 && information.is_finite() && centroid.iter().all(|c| c.is_finite());
        // Moments are often kept as f32: of points in one plane, the least value is off by 1e-7 of the
        // largest then.
        if !is_right || least < -1e-6 * largest {
            return Err(no_information);
        }
        // No pose can change how thick the inliers are: what remains is their spread within their own plane.
        let spread = eigen.values.map(|value| (value - least).max(0.0));
        let axis = |k: usize| Vector3::from(eigen.vectors[k]) * spread[k].sqrt();
        let thin = |k: usize, l: usize| if k == l { rows[k][l] - least } else { rows[k][l] };
        Ok(Self {
            pose,
            information,
            centroid: centroid.into(),
            covariance: Matrix3::from_fn(thin),
            spread: Matrix3::from_rows(&[axis(0).transpose(), axis(1).transpose(), axis(2).transpose()]),
        })
    }
}

impl View<4> for PlaneFactor {
    type Thing = WorldPlane;

    fn pose(&self) -> usize {
        self.pose
    }

    /// Distance of the centroid from the plane, and spreads of the inliers along the plane's normal, in
    /// standard deviations of the mean distance.
    fn error(&self, pose: &Isometry3<f64>, plane: &WorldPlane) -> Vector4<f64> {
        let centroid = pose.rotation * self.centroid + pose.translation.vector;
        let normal = pose.rotation.inverse() * plane.normal;
        let spread = self.spread * normal;
        let distance = plane.normal.dot(&centroid) + plane.offset;
        Vector4::new(distance, spread.x, spread.y, spread.z) * self.information.sqrt()
    }

    /// The plane's unknowns: two turns of its normal, its offset.
    fn linearized(
        &self,
        pose: &Isometry3<f64>,
        plane: &WorldPlane,
    ) -> (Vector4<f64>, Matrix4x6<f64>, Matrix4x3<f64>) {
        let rotation = *pose.rotation.to_rotation_matrix().matrix();
        let centroid = rotation * self.centroid + pose.translation.vector;
        let normal = rotation.transpose() * plane.normal;
        let weight = self.information.sqrt();
        let mut by_pose = Matrix4x6::zeros();
        by_pose.fixed_view_mut::<1, 3>(0, 0).copy_from(&self.centroid.cross(&normal).transpose());
        by_pose.fixed_view_mut::<1, 3>(0, 3).copy_from(&normal.transpose());
        by_pose.fixed_view_mut::<3, 3>(1, 0).copy_from(&(self.spread * skew(normal)));
        let mut by_plane = Matrix4x3::zeros();
        by_plane.fixed_view_mut::<1, 2>(0, 0).copy_from(&(centroid.transpose() * plane.across));
        by_plane[(0, 2)] = 1.0;
        by_plane.fixed_view_mut::<3, 2>(1, 0).copy_from(&(self.spread * rotation.transpose() * plane.across));
        (self.error(pose, plane), by_pose * weight, by_plane * weight)
    }

    /// The eigenvector of the least eigenvalue of all moments (Ferrer, "Eigen-Factors", 2019; Liu and Zhang,
    /// "BALM 2", 2022).
    fn best(views: &[Self], poses: &[Isometry3<f64>], weights: &[f64]) -> Option<WorldPlane> {
        let counts_all = weights.iter().all(|weight| *weight == 0.0);
        let mut moments = Matrix4::zeros();
        // Relative to the first centroid, so that no digits are lost far from the origin.
        let origin = views.first().map(|view| {
            let pose = &poses[view.pose];
            pose.rotation * view.centroid + pose.translation.vector
        })?;
        for (view, weight) in views.iter().zip(weights) {
            let pose = &poses[view.pose];
            let rotation = *pose.rotation.to_rotation_matrix().matrix();
            let centroid = rotation * view.centroid + pose.translation.vector - origin;
            let scatter = rotation * view.covariance * rotation.transpose() + centroid * centroid.transpose();
            let mut own = Matrix4::zeros();
            own.fixed_view_mut::<3, 3>(0, 0).copy_from(&scatter);
            own.fixed_view_mut::<3, 1>(0, 3).copy_from(&centroid);
            own[(3, 3)] = 1.0;
            moments += own * (view.information * if counts_all { 1.0 } else { *weight });
        }
        let total = moments[(3, 3)];
        let mean: Vector3<f64> = moments.fixed_view::<3, 1>(0, 3) / total;
        let scatter: Matrix3<f64> = moments.fixed_view::<3, 3>(0, 0) / total - mean * mean.transpose();
        let rows = std::array::from_fn(|k| std::array::from_fn(|l| scatter[(k, l)]));
        let eigen = symmetric_eigen3(rows)?;
        let [first, second, normal] = eigen.vectors.map(Vector3::from);
        Some(WorldPlane {
            normal,
            offset: -normal.dot(&(mean + origin)),
            across: Matrix3x2::from_columns(&[first, second]),
        })
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;
    use nalgebra::Vector6;

    use super::*;
    use crate::lie::exp;

    impl WorldPlane {
        fn moved(&self, [a, b, c]: [f64; 3]) -> Self {
            let normal = self.normal + self.across * nalgebra::Vector2::new(a, b);
            Self { normal, offset: self.offset + c, ..*self }
        }
    }

    fn random_view(random: &mut SplitMix64, pose: usize) -> PlaneView {
        let mut number = || random.fraction() - 0.5;
        let root = Matrix3::from_fn(|_, _| number());
        let c = root * root.transpose();
        PlaneView {
            pose,
            information: 5.0,
            centroid: [0; 3].map(|_| 4.0 * number()),
            covariance: [c[(0, 0)], c[(0, 1)], c[(0, 2)], c[(1, 1)], c[(1, 2)], c[(2, 2)]],
        }
    }

    fn random_pose(random: &mut SplitMix64) -> Isometry3<f64> {
        exp(&Vector6::from_fn(|_, _| 2.0 * random.fraction() - 1.0))
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let (mut random, step) = (SplitMix64::new(6), 1e-6);
        for _ in 0..20 {
            let view = PlaneFactor::new(&random_view(&mut random, 0), 1).unwrap();
            let pose = random_pose(&mut random);
            let other = PlaneFactor::new(&random_view(&mut random, 0), 1).unwrap();
            let plane = PlaneFactor::best(&[other], &[random_pose(&mut random)], &[1.0]).unwrap();
            let (_, by_pose, by_plane) = view.linearized(&pose, &plane);
            for k in 0..6 {
                let mut small = Vector6::zeros();
                small[k] = step;
                let [more, less] = [small, -small].map(|small| view.error(&(pose * exp(&small)), &plane));
                assert!((by_pose.column(k) - (more - less) / (2.0 * step)).norm() < 1e-7, "pose {k}");
            }
            for k in 0..3 {
                let moved = |by: f64| {
                    let mut small = [0.0; 3];
                    small[k] = by;
                    view.error(&pose, &plane.moved(small))
                };
                let expected = (moved(step) - moved(-step)) / (2.0 * step);
                assert!((by_plane.column(k) - expected).norm() < 1e-7, "plane {k}");
            }
        }
    }

    /// The cost of the best plane is the least eigenvalue of all moments.
    #[test]
    fn no_other_plane_costs_less() {
        let mut random = SplitMix64::new(9);
        for _ in 0..20 {
            let poses = [0; 3].map(|_| random_pose(&mut random));
            let views: Vec<_> =
                (0..3).map(|pose| PlaneFactor::new(&random_view(&mut random, pose), 3).unwrap()).collect();
            let cost = |plane: &WorldPlane| -> f64 {
                views.iter().map(|view| view.error(&poses[view.pose], plane).norm_squared()).sum()
            };
            let best = PlaneFactor::best(&views, &poses, &[1.0; 3]).unwrap();
            for k in 0..3 {
                for by in [1e-3, -1e-3] {
                    let mut small = [0.0; 3];
                    small[k] = by;
                    let moved = best.moved(small);
                    let length = moved.normal.norm();
                    let moved = WorldPlane { normal: moved.normal / length, offset: moved.offset, ..best };
                    assert!(cost(&moved) > cost(&best), "{k} {by}");
                }
            }
        }
    }

    /// 0 for views of one plane; views at a distance, or tilted, are off the plane between.
    #[test]
    fn misfit_is_the_squared_error_of_what_is_off_the_plane() {
        let covariance = [0.3, 0.0, 0.0, 0.3, 0.0, 0.0];
        let at =
            |pose, x: f64, z: f64| PlaneView { pose, information: 1e4, centroid: [x, 0.0, z], covariance };
        let poses = [Pose::identity(), Pose::new([0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0]).unwrap()];
        let of_all = |views: &[PlaneView]| PlaneView::misfit(views, views, &poses);
        assert!(of_all(&[at(0, 0.0, 3.0), at(0, 1.0, 3.0), at(1, 0.0, 1.0)]).unwrap() < 1e-9);
        // Two views 2 cm apart, over each other, are 1 cm from the plane between: one deviation each.
        let two = of_all(&[at(0, 0.0, 3.0), at(1, 0.0, 1.02)]).unwrap();
        assert!((two - 2.0).abs() < 1e-9, "{two}");
        // One is 2 cm from the plane of the other.
        let from_other = PlaneView::misfit(&[at(1, 0.0, 1.02)], &[at(0, 0.0, 3.0)], &poses).unwrap();
        assert!((from_other - 4.0).abs() < 1e-9, "{from_other}");
        // Two that are tilted by 2 degrees against each other are off by half of that each.
        let half = 1_f64.to_radians();
        let turned = Pose::new([0.0; 3], [half.sin(), 0.0, 0.0, half.cos()]).unwrap();
        let both = [at(0, 0.0, 0.0), at(1, 0.0, 0.0)];
        let tilted = PlaneView::misfit(&both, &both, &[Pose::identity(), turned]).unwrap();
        let each = 1e4 * 0.3 * half.sin().powi(2);
        assert!((tilted - 2.0 * each).abs() < 1e-9, "{tilted} {each}");
    }

    #[test]
    fn misfit_of_few_views_and_of_wrong_ones() {
        let view = random_view(&mut SplitMix64::new(5), 0);
        let poses = [Pose::identity()];
        assert!(PlaneView::misfit(&[view], &[view], &poses).unwrap() < 1e-9);
        assert_eq!(PlaneView::misfit(&[], &[], &poses), Ok(0.0));
        assert_eq!(PlaneView::misfit(&[view], &[], &poses), Err(Error::Singular));
        let unknown = PlaneView { pose: 2, ..view };
        let error = Error::UnknownPose { pose: 2, poses: 1 };
        assert_eq!(PlaneView::misfit(&[unknown], &[view], &poses), Err(error.clone()));
        assert_eq!(PlaneView::misfit(&[view], &[unknown], &poses), Err(error));
    }

    /// Noise-free depth, with moments that are kept as f32.
    #[test]
    fn points_in_one_plane_are_a_view_though_their_moments_are_rounded() {
        let mut random = SplitMix64::new(3);
        for _ in 0..100 {
            let mut direction = || [0, 1, 2].map(|_| random.fraction() - 0.5);
            let u = Vector3::from(direction()).normalize();
            let v = u.cross(&Vector3::from(direction())).normalize();
            let spread = u * u.transpose() + 0.5 * v * v.transpose();
            let rounded = |row: usize, column: usize| f64::from(spread[(row, column)] as f32);
            let covariance =
                [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(row, column)| rounded(row, column));
            let view = PlaneView { pose: 0, information: 1.0, centroid: [0.0; 3], covariance };
            assert!(PlaneFactor::new(&view, 1).is_ok(), "{view:?}");
        }
    }

    #[test]
    fn what_is_no_view_is_refused() {
        let view = random_view(&mut SplitMix64::new(1), 0);
        assert_eq!(PlaneFactor::new(&view, 0).unwrap_err(), Error::UnknownPose { pose: 0, poses: 0 });
        for wrong in [
            PlaneView { information: f64::NAN, ..view },
            PlaneView { information: 0.0, ..view },
            PlaneView { centroid: [f64::INFINITY, 0.0, 0.0], ..view },
            PlaneView { covariance: [f64::NAN; 6], ..view },
            PlaneView { covariance: [1.0, 2.0, 0.0, 1.0, 0.0, 1.0], ..view },
        ] {
            assert!(matches!(PlaneFactor::new(&wrong, 1), Err(Error::NoInformation { .. })), "{wrong:?}");
        }
    }
}

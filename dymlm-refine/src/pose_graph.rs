use dymlm_core::Pose;
use nalgebra::Isometry3;

use crate::descent::{Descent, Structure, Weights, pose_block};
use crate::graduation::Graduation;
use crate::landmark_view::LandmarkFactor;
use crate::normal_equations::NormalEquations;
use crate::plane_view::PlaneFactor;
use crate::pose_conversion::{isometry, pose};
use crate::relative_pose::RelativeFactor;
use crate::track::Tracks;
use crate::{Error, LandmarkView, PlaneView, RelativePose, SolverConfig};

/// Poses, and what is known about them: relative poses, and planes and landmarks that were seen from them.
///
/// The first pose stays where it is. The solver finds the other poses for which the cost is least: half the
/// sum of squares of all errors, each in standard deviations. A plane adds the least eigenvalue of the
/// moments of its views, a landmark the spread of its views about their weighted mean, so that they need no
/// unknowns of their own in the cost; in the equations each has three, which keeps them sparse when hundreds
/// of poses see one wall.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_refine::{PoseGraph, RelativePose, SolverConfig};
///
/// let step = Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
/// // Poses as odometry gave them, and a loop closure that says something else.
/// let mut graph = PoseGraph::new([Pose::identity(), step, step * step]);
/// for (from, to) in [(0, 1), (1, 2)] {
///     graph.add_relative(&RelativePose::with_deviations(from, to, step, 0.01, 0.1))?;
/// }
/// let closure = Pose::new([1.7, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
/// graph.add_relative(&RelativePose::with_deviations(0, 2, closure, 0.01, 0.1))?;
/// let solution = graph.optimize(&SolverConfig::default())?;
/// assert!((solution.poses[2].translation()[0] - 1.8).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PoseGraph {
    pub(crate) poses: Vec<Isometry3<f64>>,
    pub(crate) relatives: Vec<RelativeFactor>,
    planes: Tracks<PlaneFactor>,
    landmarks: Tracks<LandmarkFactor>,
    /// Indices of the relative poses that may be wrong.
    closures: Vec<usize>,
}

/// What [`PoseGraph::optimize`] has found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Solution {
    /// The poses, in the order in which they were given.
    pub poses: Vec<Pose>,
    /// Cost before the first step.
    pub initial_cost: f64,
    /// Cost of these poses, without the factors that were left out.
    pub final_cost: f64,
    /// Steps that were tried.
    pub iterations: usize,
    /// Whether it ended because the last step hardly lowered the cost, not because no more were allowed.
    pub has_converged: bool,
    /// Loop closures that were left out as wrong, by their numbers, ascending.
    pub left_out: Vec<usize>,
    /// Views that were left out as being of other planes: plane and view, by their numbers, ascending.
    pub views_left_out: Vec<[usize; 2]>,
    /// Views that were left out as being of other landmarks: landmark and view, in the same way.
    pub landmark_views_left_out: Vec<[usize; 2]>,
}

impl PoseGraph {
    /// A graph without factors. Each pose takes its body's points to the world.
    pub fn new(poses: impl IntoIterator<Item = Pose>) -> Self {
        let poses = poses.into_iter().map(|pose| isometry(&pose)).collect();
        Self {
            poses,
            relatives: Vec::new(),
            planes: Tracks::default(),
            landmarks: Tracks::default(),
            closures: Vec::new(),
        }
    }

    /// Adds a relative pose that is known to be right.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::OwnNeighbour`], [`Error::NoInformation`].
    pub fn add_relative(&mut self, relative: &RelativePose) -> Result<(), Error> {
        self.relatives.push(RelativeFactor::new(relative, self.poses.len())?);
        Ok(())
    }

    /// Adds a plane by its views. A plane that a single pose has seen says nothing. Views that contradict
    /// everything else, since they are of another plane, are left out and [named](Solution::views_left_out)
    /// by two numbers from 0: the plane's among those added, and the view's own.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::NoInformation`]: then no view of the plane is added.
    pub fn add_plane(&mut self, views: &[PlaneView]) -> Result<(), Error> {
        let views: Result<Vec<_>, _> =
            views.iter().map(|view| PlaneFactor::new(view, self.poses.len())).collect();
        self.planes.add(views?);
        Ok(())
    }

    /// Adds a landmark by its views. A landmark that a single pose has seen says nothing. Views that
    /// contradict everything else, since they are of another thing, are left out and
    /// [named](Solution::landmark_views_left_out) by two numbers from 0: the landmark's among those added,
    /// and the view's own.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::NoInformation`]: then no view of the landmark is added.
    pub fn add_landmark(&mut self, views: &[LandmarkView]) -> Result<(), Error> {
        let views: Result<Vec<_>, _> =
            views.iter().map(|view| LandmarkFactor::new(view, self.poses.len())).collect();
        self.landmarks.add(views?);
        Ok(())
    }

    /// Adds a loop closure: a relative pose that may be wrong. A closure that contradicts everything else is
    /// left out and [named](Solution::left_out) by its number among those added, from 0.
    ///
    /// # Errors
    ///
    /// As [`Self::add_relative`].
    pub fn add_loop_closure(&mut self, closure: &RelativePose) -> Result<(), Error> {
        self.add_relative(closure)?;
        self.closures.push(self.relatives.len() - 1);
        Ok(())
    }

    /// The poses of least cost, by Levenberg-Marquardt. Wrong loop closures and views of planes are left out
    /// by graduated non-convexity (Yang, Antonante, Tzoumas, Carlone, RA-L 2020, truncated least squares).
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::Singular`] where numbers are too large.
    pub fn optimize(&self, config: &SolverConfig) -> Result<Solution, Error> {
        config.validate()?;
        let mut descent = Descent::begin(self, config)?;
        let initial_cost = descent.cost();
        descent.run();
        let mut graduation = Graduation::begin(self.doubtful_errors(&descent, config));
        let mut weights = self.full_weights();
        while let Some(doubtful) = graduation.next() {
            weights = self.weights(doubtful);
            descent.weigh(weights.clone())?;
            if graduation.are_final() {
                descent.run();
            } else {
                descent.step();
            }
            graduation.look_at(self.doubtful_errors(&descent, config));
        }
        let poses: Option<Vec<Pose>> = descent.poses().iter().map(pose).collect();
        Ok(Solution {
            poses: poses.ok_or(Error::Singular)?,
            initial_cost,
            final_cost: descent.cost(),
            iterations: descent.iterations(),
            has_converged: descent.has_converged(),
            left_out: self.closures_left_out(&weights),
            views_left_out: self.planes.left_out(&weights.views),
            landmark_views_left_out: self.landmarks.left_out(&weights.landmark_views),
        })
    }

    /// Covariances of poses of a solution, relative to the first pose, which counts as exact: of a small
    /// motion of the body in its own axes, three rotations (radians) before three translations (metres). All
    /// factors count but those that were left out. Linearized, and only as good as the covariances of the
    /// factors.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`]; [`Error::Singular`] where the factors do not hold some motion
    /// of one of these poses.
    #[doc(alias = "marginals")]
    pub fn covariances(&self, solution: &Solution, of: &[usize]) -> Result<Vec<[[f64; 6]; 6]>, Error> {
        let count = self.poses.len();
        if let Some(&pose) = of.iter().find(|pose| **pose >= count) {
            return Err(Error::UnknownPose { pose, poses: count });
        }
        let (poses, weights) =
            (solution.poses.iter().map(isometry).collect::<Vec<_>>(), self.without(solution));
        if let Some(pose) = (poses.len() != count).then_some(poses.len()) {
            return Err(Error::UnknownPose { pose, poses: count });
        }
        let mut equations = self.equations()?;
        self.linearize(&poses, &self.best_structure(&poses, &weights)?, &weights, &mut equations);
        let blocks: Vec<usize> = of.iter().filter_map(|pose| pose_block(*pose)).collect();
        let mut inverses = equations.inverses(&blocks).ok_or(Error::Singular)?.into_iter();
        let covariance = |pose: &usize| {
            let inverse = pose_block(*pose).and_then(|_| inverses.next());
            // The inverse is symmetric: columns are rows.
            inverse.map_or([[0.0; 6]; 6], |inverse| {
                std::array::from_fn(|row| std::array::from_fn(|column| inverse[6 * row + column]))
            })
        };
        Ok(of.iter().map(covariance).collect())
    }

    /// Weights 0 for what a solution has left out, 1 for everything else.
    fn without(&self, solution: &Solution) -> Weights {
        let mut weights = self.full_weights();
        for &closure in &solution.left_out {
            if let Some(&index) = self.closures.get(closure) {
                weights.relatives[index] = 0.0;
            }
        }
        let Weights { views, landmark_views, .. } = &mut weights;
        self.planes.leave_out(views, &solution.views_left_out);
        self.landmarks.leave_out(landmark_views, &solution.landmark_views_left_out);
        weights
    }

    /// Squared errors of factors that may be wrong, loop closures, views of planes and views of landmarks in
    /// this order, divided by the largest squared error of a right factor.
    fn doubtful_errors(&self, descent: &Descent<'_>, config: &SolverConfig) -> Vec<f64> {
        let poses = descent.poses();
        let closures = self.closures.iter().map(|&index| {
            let closure = &self.relatives[index];
            closure.error(closure.poses.map(|pose| &poses[pose])).norm_squared() / config.max_closure_error
        });
        let Structure { planes, places } = descent.structure();
        let views = self.planes.squared_errors(poses, planes);
        let views = views.chain(self.landmarks.squared_errors(poses, places));
        closures.chain(views.map(|error| error / config.max_view_error)).collect()
    }

    pub(crate) fn full_weights(&self) -> Weights {
        Weights {
            relatives: vec![1.0; self.relatives.len()],
            views: self.planes.full_weights(),
            landmark_views: self.landmarks.full_weights(),
        }
    }

    /// All weights; `doubtful`: those of factors that may be wrong, in the order of
    /// [`Self::doubtful_errors`].
    fn weights(&self, doubtful: &[f64]) -> Weights {
        let (mut weights, mut doubtful) = (self.full_weights(), doubtful.iter());
        let closures = self.closures.iter().copied();
        for (closure, weight) in closures.zip(doubtful.by_ref()) {
            weights.relatives[closure] = *weight;
        }
        let Weights { views, landmark_views, .. } = &mut weights;
        for (view, weight) in views.iter_mut().chain(landmark_views).flatten().zip(doubtful) {
            *view = *weight;
        }
        weights
    }

    fn closures_left_out(&self, weights: &Weights) -> Vec<usize> {
        let closures = self.closures.iter().enumerate();
        closures.filter(|(_, index)| weights.relatives[**index] < 0.5).map(|(number, _)| number).collect()
    }

    /// The first block of the planes in the equations, and that of the landmarks.
    fn first_blocks(&self) -> [usize; 2] {
        let poses = self.poses.len().saturating_sub(1);
        [poses, poses + self.planes.len()]
    }

    pub(crate) fn equations(&self) -> Result<NormalEquations, Error> {
        let things = std::iter::repeat_n(3, self.planes.len() + self.landmarks.len());
        let sizes = self.poses.iter().skip(1).map(|_| 6).chain(things);
        let [planes, landmarks] = self.first_blocks();
        let between_poses = self.relatives.iter().filter_map(|relative| {
            let [from, to] = relative.poses.map(pose_block);
            Some((from?, to?))
        });
        let with_things = self.planes.coupled(planes).chain(self.landmarks.coupled(landmarks));
        NormalEquations::new(sizes, between_poses.chain(with_things))
    }

    /// The planes and places that are best at these poses.
    pub(crate) fn best_structure(
        &self,
        poses: &[Isometry3<f64>],
        weights: &Weights,
    ) -> Result<Structure, Error> {
        let planes = self.planes.best(poses, &weights.views);
        let places = self.landmarks.best(poses, &weights.landmark_views);
        planes.zip(places).map(|(planes, places)| Structure { planes, places }).ok_or(Error::Singular)
    }

    pub(crate) fn cost(&self, poses: &[Isometry3<f64>], structure: &Structure, weights: &Weights) -> f64 {
        let relatives = self.relatives.iter().zip(&weights.relatives).map(|(relative, weight)| {
            weight * relative.error(relative.poses.map(|pose| &poses[pose])).norm_squared()
        });
        let weighted = |(error, weight): (f64, &f64)| weight * error;
        let views = self.planes.squared_errors(poses, &structure.planes);
        let views = views.zip(weights.views.iter().flatten()).map(weighted);
        let landmark_views = self.landmarks.squared_errors(poses, &structure.places);
        let landmark_views = landmark_views.zip(weights.landmark_views.iter().flatten()).map(weighted);
        0.5 * (relatives.sum::<f64>() + views.sum::<f64>() + landmark_views.sum::<f64>())
    }

    pub(crate) fn linearize(
        &self,
        poses: &[Isometry3<f64>],
        structure: &Structure,
        weights: &Weights,
        equations: &mut NormalEquations,
    ) {
        equations.clear();
        for (relative, &weight) in self.relatives.iter().zip(&weights.relatives) {
            let (error, by_poses) = relative.linearized(relative.poses.map(|pose| &poses[pose]));
            let blocks = relative.poses.map(pose_block);
            for (k, &row) in blocks.iter().enumerate() {
                let Some(row) = row else { continue };
                equations.subtract(row, &(by_poses[k].transpose() * error * weight));
                equations.add([row; 2], &(by_poses[k].transpose() * by_poses[k] * weight));
            }
            if let [Some(from), Some(to)] = blocks {
                equations.add([from, to], &(by_poses[0].transpose() * by_poses[1] * weight));
            }
        }
        let [planes, landmarks] = self.first_blocks();
        self.planes.linearize(poses, &structure.planes, &weights.views, planes, equations);
        self.landmarks.linearize(poses, &structure.places, &weights.landmark_views, landmarks, equations);
    }
}

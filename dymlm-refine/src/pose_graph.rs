use dymlm_core::Pose;
use nalgebra::{Isometry3, Vector6};

use crate::lie::exp;
use crate::normal_equations::NormalEquations;
use crate::plane_view::{PlaneFactor, PlaneTrack, WorldPlane};
use crate::pose_conversion::{isometry, pose};
use crate::relative_pose::RelativeFactor;
use crate::{Error, PlaneView, RelativePose, SolverConfig};

/// Poses, and what is known of them: relative poses, and planes that were seen from them.
///
/// The first pose stays where it is; of all others those are sought that make the cost least: half the sum of
/// squares of all errors, each in standard deviations. A plane adds the least eigenvalue of the moments of
/// its views, so that it needs no unknowns of its own in the cost; in the equations it has three, which keeps
/// them sparse when hundreds of poses see one wall.
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
    poses: Vec<Isometry3<f64>>,
    relatives: Vec<RelativeFactor>,
    planes: Vec<PlaneTrack>,
}

/// What [`PoseGraph::optimize`] has found.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Solution {
    /// The poses, in the order in which they were given.
    pub poses: Vec<Pose>,
    /// Cost before the first step.
    pub initial_cost: f64,
    /// Cost of these poses.
    pub final_cost: f64,
    /// Steps that were tried.
    pub iterations: usize,
    /// Whether the last step hardly lowered the cost, instead of being the last allowed.
    pub has_converged: bool,
}

/// Damping of the first step, and the factors by which it changes.
const FIRST_DAMPING: f64 = 1e-5;
const LESS_DAMPING: f64 = 0.1;
const MORE_DAMPING: f64 = 10.0;
/// With more, steps are too small to change anything.
const MOST_DAMPING: f64 = 1e12;

impl PoseGraph {
    /// Without any factor. Each pose takes its body's points to the world.
    pub fn new(poses: impl IntoIterator<Item = Pose>) -> Self {
        let poses = poses.into_iter().map(|pose| isometry(&pose)).collect();
        Self { poses, relatives: Vec::new(), planes: Vec::new() }
    }

    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::OwnNeighbour`], [`Error::NoInformation`].
    pub fn add_relative(&mut self, relative: &RelativePose) -> Result<(), Error> {
        self.relatives.push(RelativeFactor::new(relative, self.poses.len())?);
        Ok(())
    }

    /// Adds a plane by what was seen of it. One that a single pose has seen says nothing.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownPose`], [`Error::NoInformation`]: then no view of it is added.
    pub fn add_plane(&mut self, views: &[PlaneView]) -> Result<(), Error> {
        let views: Result<Vec<_>, _> =
            views.iter().map(|view| PlaneFactor::new(view, self.poses.len())).collect();
        let track = PlaneTrack { views: views? };
        let first = track.views.first().map(|view| view.pose);
        if track.views.iter().any(|view| Some(view.pose) != first) {
            self.planes.push(track);
        }
        Ok(())
    }

    /// The poses of least cost, by Levenberg-Marquardt.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::Singular`] where numbers are too large.
    pub fn optimize(&self, config: &SolverConfig) -> Result<Solution, Error> {
        config.validate()?;
        let mut poses = self.poses.clone();
        let mut planes = self.best_planes(&poses)?;
        let mut cost = self.cost(&poses, &planes);
        let initial_cost = cost;
        let mut equations = self.equations()?;
        let (mut damping, mut iterations, mut has_converged) = (FIRST_DAMPING, 0, self.poses.len() < 2);
        while !has_converged && iterations < config.max_iterations {
            self.linearize(&poses, &planes, &mut equations);
            let before = cost;
            // Tried again with more damping until it lowers the cost.
            loop {
                iterations += 1;
                let stepped = equations.solve(damping).and_then(|(step, promised)| {
                    let poses = stepped(&poses, &equations, &step);
                    let planes = self.best_planes(&poses).ok()?;
                    let cost = self.cost(&poses, &planes);
                    (cost <= before).then_some((poses, planes, cost, promised))
                });
                if let Some((new_poses, new_planes, new_cost, promised)) = stepped {
                    (poses, planes, cost) = (new_poses, new_planes, new_cost);
                    has_converged = before - cost <= config.relative_decrease * before;
                    let is_as_promised = before - cost > 0.25 * promised;
                    damping *= if is_as_promised { LESS_DAMPING } else { 1.0 };
                    break;
                }
                damping *= MORE_DAMPING;
                if damping > MOST_DAMPING || equations.steepness() == 0.0 {
                    has_converged = true;
                    break;
                }
                if iterations >= config.max_iterations {
                    break;
                }
            }
        }
        let poses: Option<Vec<Pose>> = poses.iter().map(pose).collect();
        let poses = poses.ok_or(Error::Singular)?;
        Ok(Solution { poses, initial_cost, final_cost: cost, iterations, has_converged })
    }

    fn plane_block(&self, plane: usize) -> usize {
        self.poses.len() - 1 + plane
    }

    fn equations(&self) -> Result<NormalEquations, Error> {
        let sizes = self.poses.iter().skip(1).map(|_| 6).chain(self.planes.iter().map(|_| 3));
        let between_poses = self.relatives.iter().filter_map(|relative| {
            let [from, to] = relative.poses.map(pose_block);
            Some((from?, to?))
        });
        let with_planes = self.planes.iter().enumerate().flat_map(|(number, plane)| {
            let blocks = plane.views.iter().filter_map(|view| pose_block(view.pose));
            blocks.map(move |block| (block, self.plane_block(number)))
        });
        NormalEquations::new(sizes, between_poses.chain(with_planes))
    }

    fn best_planes(&self, poses: &[Isometry3<f64>]) -> Result<Vec<WorldPlane>, Error> {
        self.planes.iter().map(|plane| plane.best(poses).ok_or(Error::Singular)).collect()
    }

    fn cost(&self, poses: &[Isometry3<f64>], planes: &[WorldPlane]) -> f64 {
        let relatives = self
            .relatives
            .iter()
            .map(|relative| relative.error(relative.poses.map(|pose| &poses[pose])).norm_squared());
        let views = self.planes.iter().zip(planes).flat_map(|(track, plane)| {
            track.views.iter().map(|view| view.error(&poses[view.pose], plane).norm_squared())
        });
        0.5 * (relatives.sum::<f64>() + views.sum::<f64>())
    }

    fn linearize(&self, poses: &[Isometry3<f64>], planes: &[WorldPlane], equations: &mut NormalEquations) {
        equations.clear();
        for relative in &self.relatives {
            let (error, by_poses) = relative.linearized(relative.poses.map(|pose| &poses[pose]));
            let blocks = relative.poses.map(pose_block);
            for (k, &row) in blocks.iter().enumerate() {
                let Some(row) = row else { continue };
                equations.subtract(row, &(by_poses[k].transpose() * error));
                equations.add([row; 2], &(by_poses[k].transpose() * by_poses[k]));
            }
            if let [Some(from), Some(to)] = blocks {
                equations.add([from, to], &(by_poses[0].transpose() * by_poses[1]));
            }
        }
        for (number, (track, plane)) in self.planes.iter().zip(planes).enumerate() {
            let own = self.plane_block(number);
            for view in &track.views {
                let (error, by_pose, by_plane) = view.linearized(&poses[view.pose], plane);
                equations.subtract(own, &(by_plane.transpose() * error));
                equations.add([own; 2], &(by_plane.transpose() * by_plane));
                if let Some(block) = pose_block(view.pose) {
                    equations.subtract(block, &(by_pose.transpose() * error));
                    equations.add([block; 2], &(by_pose.transpose() * by_pose));
                    equations.add([own, block], &(by_plane.transpose() * by_pose));
                }
            }
        }
    }
}

/// The poses after a step of the equations' unknowns. The first has none.
fn stepped(poses: &[Isometry3<f64>], equations: &NormalEquations, step: &[f64]) -> Vec<Isometry3<f64>> {
    let moved = |(index, pose): (usize, &Isometry3<f64>)| {
        let Some(block) = pose_block(index) else { return *pose };
        let mut moved = pose * exp(&Vector6::from_column_slice(equations.of_block(step, block)));
        moved.rotation.renormalize();
        moved
    };
    poses.iter().enumerate().map(moved).collect()
}

/// The block of a pose in the equations: the first has none.
fn pose_block(pose: usize) -> Option<usize> {
    pose.checked_sub(1)
}

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::lie::exp;
use crate::normal_equations::NormalEquations;
use crate::plane_view::WorldPlane;
use crate::track::ViewWeights;
use crate::{Error, PoseGraph, SolverConfig};

/// Damping of the first step, and the factors by which it changes.
const FIRST_DAMPING: f64 = 1e-5;
const LESS_DAMPING: f64 = 0.1;
const MORE_DAMPING: f64 = 10.0;
/// With more damping, steps are too small to change anything.
const MOST_DAMPING: f64 = 1e12;

/// Levenberg-Marquardt on the poses of a graph; the weights of its factors may change between runs.
pub(crate) struct Descent<'a> {
    graph: &'a PoseGraph,
    config: &'a SolverConfig,
    equations: NormalEquations,
    weights: Weights,
    estimate: Estimate,
    iterations: usize,
    has_converged: bool,
}

/// Weights of factors, in addition to their information: 1 until a factor is found to be wrong.
#[derive(Debug, Clone)]
pub(crate) struct Weights {
    pub(crate) relatives: Vec<f64>,
    /// Those of the planes.
    pub(crate) views: ViewWeights,
    pub(crate) landmark_views: ViewWeights,
}

/// What the poses have seen, in the world.
pub(crate) struct Structure {
    pub(crate) planes: Vec<WorldPlane>,
    /// Those of the landmarks.
    pub(crate) places: Vec<Vector3<f64>>,
}

/// Poses, and the structure that is best at these poses.
struct Estimate {
    poses: Vec<Isometry3<f64>>,
    structure: Structure,
    cost: f64,
}

impl<'a> Descent<'a> {
    /// Begins at the graph's own poses, with all weights 1.
    pub(crate) fn begin(graph: &'a PoseGraph, config: &'a SolverConfig) -> Result<Self, Error> {
        let (poses, weights) = (graph.poses.clone(), graph.full_weights());
        let structure = graph.best_structure(&poses, &weights)?;
        let cost = graph.cost(&poses, &structure, &weights);
        let (estimate, equations) = (Estimate { poses, structure, cost }, graph.equations()?);
        Ok(Self { graph, config, equations, weights, estimate, iterations: 0, has_converged: false })
    }

    pub(crate) fn poses(&self) -> &[Isometry3<f64>] {
        &self.estimate.poses
    }

    pub(crate) fn structure(&self) -> &Structure {
        &self.estimate.structure
    }

    pub(crate) fn cost(&self) -> f64 {
        self.estimate.cost
    }

    pub(crate) fn iterations(&self) -> usize {
        self.iterations
    }

    pub(crate) fn has_converged(&self) -> bool {
        self.has_converged
    }

    /// Gives the factors other weights.
    pub(crate) fn weigh(&mut self, weights: Weights) -> Result<(), Error> {
        let Estimate { poses, structure, cost } = &mut self.estimate;
        *structure = self.graph.best_structure(poses, &weights)?;
        *cost = self.graph.cost(poses, structure, &weights);
        self.weights = weights;
        Ok(())
    }

    /// Steps until the cost hardly decreases any more, or no more steps are allowed.
    pub(crate) fn run(&mut self) {
        let end = self.iterations + self.config.max_iterations;
        let mut damping = FIRST_DAMPING;
        self.has_converged = self.graph.poses.len() < 2;
        while !self.has_converged && self.iterations < end {
            let Estimate { poses, structure, .. } = &self.estimate;
            self.graph.linearize(poses, structure, &self.weights, &mut self.equations);
            let before = self.estimate.cost;
            // A step is tried again with more damping until it lowers the cost.
            while !self.has_converged && self.iterations < end {
                self.iterations += 1;
                if let Some((next, promised)) = self.stepped(damping) {
                    let gain = before - next.cost;
                    self.estimate = next;
                    self.has_converged = gain <= self.config.relative_decrease * before;
                    damping *= if gain > 0.25 * promised { LESS_DAMPING } else { 1.0 };
                    break;
                }
                damping *= MORE_DAMPING;
                self.has_converged = damping > MOST_DAMPING || self.equations.steepness() == 0.0;
            }
        }
    }

    /// The estimate after a step, and how much the step lowers the linearized cost; `None` where the cost
    /// itself rises.
    fn stepped(&mut self, damping: f64) -> Option<(Estimate, f64)> {
        let (step, promised) = self.equations.solve(damping)?;
        let poses = stepped(&self.estimate.poses, &self.equations, &step);
        let structure = self.graph.best_structure(&poses, &self.weights).ok()?;
        let cost = self.graph.cost(&poses, &structure, &self.weights);
        (cost <= self.estimate.cost).then_some((Estimate { poses, structure, cost }, promised))
    }
}

/// The poses after a step of the equations' unknowns; the first pose has no unknowns.
fn stepped(poses: &[Isometry3<f64>], equations: &NormalEquations, step: &[f64]) -> Vec<Isometry3<f64>> {
    let moved = |(index, pose): (usize, &Isometry3<f64>)| {
        let Some(block) = pose_block(index) else { return *pose };
        let mut moved = pose * exp(&Vector6::from_column_slice(equations.of_block(step, block)));
        moved.rotation.renormalize();
        moved
    };
    poses.iter().enumerate().map(moved).collect()
}

/// The block of a pose in the equations; the first pose has none.
pub(crate) fn pose_block(pose: usize) -> Option<usize> {
    pose.checked_sub(1)
}

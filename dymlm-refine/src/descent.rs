use nalgebra::{Isometry3, Vector3, Vector6};

use crate::lie::{adjoint, exp};
use crate::normal_equations::NormalEquations;
use crate::plane_view::WorldPlane;
use crate::track::ViewWeights;
use crate::{Error, PoseGraph, SolverConfig};

/// Damping of the first step.
const FIRST_DAMPING: f64 = 1e-5;
/// Factor by which damping changes: down at least by so much, up the further the more often in a row.
const MORE_DAMPING: f64 = 10.0;
/// With more damping, steps are too small to change anything; less is lost in rounding.
const MOST_DAMPING: f64 = 1e12;
const LEAST_DAMPING: f64 = f64::EPSILON;

/// Levenberg-Marquardt on the poses of a graph; the weights of its factors may change between runs.
pub(crate) struct Descent<'a> {
    graph: &'a PoseGraph,
    config: &'a SolverConfig,
    equations: NormalEquations,
    weights: Weights,
    estimate: Estimate,
    damping: f64,
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
        let damping = FIRST_DAMPING;
        Ok(Self { graph, config, equations, weights, estimate, damping, iterations: 0, has_converged: false })
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
        let end = self.begin_steps();
        while !self.has_converged && self.iterations < end {
            self.step_before(end);
        }
    }

    /// One step that lowers the cost: enough where the weights are about to change.
    pub(crate) fn step(&mut self) {
        let end = self.begin_steps();
        self.step_before(end);
    }

    /// With no more damping than for the first step; says how many iterations may have been at the end.
    fn begin_steps(&mut self) -> usize {
        self.has_converged = self.graph.poses.len() < 2;
        self.damping = self.damping.min(FIRST_DAMPING);
        self.iterations + self.config.max_iterations
    }

    /// Tries a step with more and more damping until it lowers the cost, or no more are allowed.
    fn step_before(&mut self, end: usize) {
        let Estimate { poses, structure, cost: before } = &self.estimate;
        let before = *before;
        self.graph.linearize(poses, structure, &self.weights, &mut self.equations);
        let mut more = MORE_DAMPING;
        while !self.has_converged && self.iterations < end {
            self.iterations += 1;
            if let Some((next, promised)) = self.stepped() {
                let gain = before - next.cost;
                self.estimate = next;
                self.has_converged = gain <= self.config.relative_decrease * before;
                // The damping holds off what the linearized cost does not show: it shrinks to the share of
                // the promise by which that was wrong. By a constant factor, a long chain of poses would wait
                // for its bends, which the least damping holds, the longer the longer it is.
                if gain > 0.25 * promised {
                    let missed = (1.0 - gain / promised).abs();
                    self.damping = (self.damping * missed.min(1.0 / MORE_DAMPING)).max(LEAST_DAMPING);
                }
                return;
            }
            self.damping *= more;
            more *= MORE_DAMPING;
            self.has_converged = self.damping > MOST_DAMPING || self.equations.steepness() == 0.0;
        }
    }

    /// The estimate after a step, and how much the step lowers the linearized cost; `None` where the cost
    /// itself rises.
    fn stepped(&mut self) -> Option<(Estimate, f64)> {
        let (step, promised) = self.equations.solve(self.damping)?;
        let moved = [moved_alone, moved_in_chain].map(|moved| {
            let poses = moved(&self.estimate.poses, &self.equations, &step);
            let structure = self.graph.best_structure(&poses, &self.weights).ok()?;
            let cost = self.graph.cost(&poses, &structure, &self.weights);
            (cost <= self.estimate.cost).then_some(Estimate { poses, structure, cost })
        });
        let best = moved.into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some((best, promised))
    }
}

/// The poses after a step of the equations' unknowns, each moved by its own part. The first pose has no
/// unknowns.
///
/// This keeps together what a loop closes. But where a drift of metres is taken out, the motion between
/// neighbours errs by the product of what they have moved and of how differently.
fn moved_alone(poses: &[Isometry3<f64>], equations: &NormalEquations, step: &[f64]) -> Vec<Isometry3<f64>> {
    let moved = |(index, pose): (usize, &Isometry3<f64>)| match index {
        0 => *pose,
        index => normalized(pose * exp(&part(equations, step, index))),
    };
    poses.iter().enumerate().map(moved).collect()
}

/// The same step to first order, but the motions between consecutive poses take the parts by which these
/// differ. So a chain of poses bends as far as it has to; only, what a loop closes errs by all of its bends.
fn moved_in_chain(
    poses: &[Isometry3<f64>],
    equations: &NormalEquations,
    step: &[f64],
) -> Vec<Isometry3<f64>> {
    let mut moved: Vec<Isometry3<f64>> = poses.iter().take(1).copied().collect();
    for (index, pair) in poses.windows(2).enumerate() {
        let motion = pair[0].inverse() * pair[1];
        let [one, next] = [index, index + 1].map(|index| part(equations, step, index));
        let own = next - adjoint(&motion.inverse()) * one;
        moved.push(normalized(moved[index] * motion * exp(&own)));
    }
    moved
}

/// The part of a step that moves a pose.
fn part(equations: &NormalEquations, step: &[f64], pose: usize) -> Vector6<f64> {
    let block = pose_block(pose);
    block.map_or(Vector6::zeros(), |block| Vector6::from_column_slice(equations.of_block(step, block)))
}

fn normalized(mut pose: Isometry3<f64>) -> Isometry3<f64> {
    pose.rotation.renormalize();
    pose
}

/// The block of a pose in the equations; the first pose has none.
pub(crate) fn pose_block(pose: usize) -> Option<usize> {
    pose.checked_sub(1)
}

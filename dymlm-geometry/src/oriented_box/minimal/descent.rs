use dymlm_core::vector3::{Vector3, dot, norm};

use super::extents::Extents;
use super::rotation::{Axes, turned};
use crate::convex_polytope::VertexGraph;

/// A box on its way to a smaller one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Descent {
    axes: Axes,
    extents: Extents,
    volume: f64,
}

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Effort {
    iterations: usize,
    /// The descent ends when an iteration takes no greater share off the volume than this.
    least_gain: f64,
}

pub(super) const COARSE: Effort = Effort { iterations: 3, least_gain: 1e-3 };
pub(super) const FINE: Effort = Effort { iterations: 60, least_gain: 1e-7 };

/// First step, radians.
const FIRST_STEP: f64 = 0.1;
/// Greatest number of boxes tried on a line.
const MOST_TRIALS: usize = 16;
/// Shares of the slope at the beginning of a line: the gain that a step must reach (Armijo), and the slope
/// that may be left at its end (Wolfe). Usual values.
const ENOUGH_GAIN: f64 = 1e-4;
const ENOUGH_SLOPE: f64 = 0.5;

impl Descent {
    pub(super) fn new(axes: Axes, extents: Extents) -> Self {
        Self { axes, extents, volume: extents.volume() }
    }

    pub(super) fn axes(&self) -> &Axes {
        &self.axes
    }

    pub(super) fn extents(&self) -> &Extents {
        &self.extents
    }

    pub(super) fn volume(&self) -> f64 {
        self.volume
    }

    /// The box turned.
    fn turned(&self, hull: &VertexGraph, by: Vector3) -> Self {
        let axes = turned(&self.axes, by);
        Self::new(axes, Extents::of(hull, &axes, self.extents.touching()))
    }
}

/// Turns a box until its volume is at a local minimum.
///
/// The volume has kinks where a side comes to touch another vertex, and minima mostly are where several
/// kinks meet. BFGS with a line search by bisection finds them: its matrix learns the kinks as directions of
/// great curvature. Lewis, Overton: "Nonsmooth optimization via quasi-Newton methods", Mathematical
/// Programming 141, 2013.
pub(super) fn descend(hull: &VertexGraph, at: &mut Descent, effort: Effort) {
    let mut gradient = at.extents.gradient(hull, &at.axes);
    let mut inverse = scaled_identity(FIRST_STEP / norm(gradient));
    for iteration in 0..effort.iterations {
        let direction = inverse.map(|row| -dot(row, gradient));
        let Some((next, step)) = search_line(hull, at, gradient, direction) else { return };
        let next_gradient = next.extents.gradient(hull, &next.axes);
        let change = [0, 1, 2].map(|k| next_gradient[k] - gradient[k]);
        let gain = (at.volume - next.volume) / at.volume;
        (*at, gradient) = (next, next_gradient);
        if gain <= effort.least_gain {
            return;
        }
        if iteration == 0 {
            inverse = scaled_identity(dot(step, change) / dot(change, change));
        }
        update(&mut inverse, step, change);
    }
}

/// The box at the end of a step down a line, and the step; `None` when no step is found that gains.
fn search_line(
    hull: &VertexGraph,
    from: &Descent,
    gradient: Vector3,
    direction: Vector3,
) -> Option<(Descent, Vector3)> {
    let slope = dot(gradient, direction);
    if slope >= 0.0 || slope.is_nan() {
        return None;
    }
    let (mut low, mut high, mut share) = (0.0, f64::INFINITY, 1.0);
    let mut best = None;
    for _ in 0..MOST_TRIALS {
        let step = direction.map(|x| share * x);
        let trial = from.turned(hull, step);
        let gain = (from.volume - trial.volume) / from.volume;
        if gain < -ENOUGH_GAIN * share * slope {
            high = share;
        } else {
            best = Some((trial, step));
            if dot(trial.extents.gradient(hull, &trial.axes), direction) >= ENOUGH_SLOPE * slope {
                return best;
            }
            low = share;
        }
        share = if high.is_finite() { f64::midpoint(low, high) } else { 2.0 * low };
    }
    best
}

/// Updates the inverse of the curvature's matrix by what a step has shown (BFGS).
fn update(inverse: &mut [Vector3; 3], step: Vector3, change: Vector3) {
    let curvature = dot(step, change);
    if curvature <= 0.0 || curvature.is_nan() {
        return;
    }
    let across = inverse.map(|row| dot(row, change));
    let factor = (1.0 + dot(change, across) / curvature) / curvature;
    for (row, inverse) in inverse.iter_mut().enumerate() {
        for (column, entry) in inverse.iter_mut().enumerate() {
            *entry += factor * step[row] * step[column]
                - (across[row] * step[column] + step[row] * across[column]) / curvature;
        }
    }
}

fn scaled_identity(scale: f64) -> [Vector3; 3] {
    let scale = if scale.is_finite() && scale > 0.0 { scale } else { FIRST_STEP };
    [[scale, 0.0, 0.0], [0.0, scale, 0.0], [0.0, 0.0, scale]]
}

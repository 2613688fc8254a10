use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tiny_solver::factors::Factor;
use tiny_solver::manifold::se3::{SE3, SE3Manifold};
use tiny_solver::na;
use tiny_solver::{GaussNewtonOptimizer, LevenbergMarquardtOptimizer, Optimizer, OptimizerOptions, Problem};

use crate::Failure;
use crate::g2o;
use crate::request::Request;
use crate::solved::Solved;
use crate::timing::{Timing, timed};

/// A factor between two poses with the error that the other libraries minimize. The library's own factor has
/// no information matrix, and uses the translation in place of its logarithm.
struct Between {
    /// Quaternion x y z w and translation.
    measured: na::DVector<f64>,
    /// Rows whose outer products sum to the information matrix, each without its zeros.
    root: Vec<Vec<(usize, f64)>>,
}

impl Between {
    fn new(edge: &g2o::Edge) -> Result<Self, Failure> {
        let root = edge.information.cholesky().ok_or("information that is not positive definite")?.l();
        let row = |k: usize| {
            root.column(k).iter().copied().enumerate().filter(|(_, number)| *number != 0.0).collect()
        };
        Ok(Self { measured: parameters(&edge.measured), root: (0..6).map(row).collect() })
    }
}

impl<T: na::RealField> Factor<T> for Between {
    fn residual_func(&self, poses: &[na::DVector<T>]) -> na::DVector<T> {
        let measured = SE3::from_vec(self.measured.clone().cast::<T>().as_view());
        let [from, to] = [0, 1].map(|k| SE3::from_vec(poses[k].as_view()));
        let error = logarithm(&(measured.inverse() * (from.inverse() * to)));
        let whitened = self.root.iter().map(|row| {
            row.iter().fold(T::zero(), |sum, &(k, number)| sum + error[k].clone() * na::convert(number))
        });
        na::DVector::from_iterator(6, whitened)
    }
}

/// The logarithm of SE(3), rotation first.
fn logarithm<T: na::RealField>(pose: &SE3<T>) -> na::Vector6<T> {
    let rotation = na::Vector3::from_iterator(pose.rot.log().iter().cloned());
    let square = rotation.norm_squared();
    let factor = if square < na::convert(1e-6) {
        square * na::convert(1.0 / 720.0) + na::convert(1.0 / 12.0)
    } else {
        let half = square.clone().sqrt() * na::convert(0.5);
        (T::one() - half.clone() * half.clone().cos() / half.sin()) / square
    };
    let turned = rotation.cross(&pose.xyz);
    let translation = &pose.xyz - &turned * na::convert::<f64, T>(0.5) + rotation.cross(&turned) * factor;
    let [[x, y, z]] = rotation.data.0;
    let [[u, v, w]] = translation.data.0;
    na::Vector6::new(x, y, z, u, v, w)
}

/// Fixes the first pose, and counts how often it is linearized, since the library does not report its
/// iterations.
struct Held {
    parameters: na::DVector<f64>,
    linearized: Arc<AtomicUsize>,
}

/// Inverse standard deviation of the fixed first pose.
const HELD: f64 = 1e4;

impl<T: na::RealField> Factor<T> for Held {
    fn residual_func(&self, poses: &[na::DVector<T>]) -> na::DVector<T> {
        // Called with plain numbers for the cost, and with larger dual numbers for a linearization.
        if size_of::<T>() > size_of::<f64>() {
            self.linearized.fetch_add(1, Ordering::Relaxed);
        }
        let held = SE3::from_vec(self.parameters.clone().cast::<T>().as_view());
        (held.inverse() * SE3::from_vec(poses[0].as_view())).log() * na::convert::<f64, T>(HELD)
    }
}

/// A pose in the library's order: quaternion x y z w before the translation.
fn parameters(&[x, y, z, qx, qy, qz, qw]: &[f64; 7]) -> na::DVector<f64> {
    let length = (qx * qx + qy * qy + qz * qz + qw * qw).sqrt();
    na::DVector::from_column_slice(&[qx / length, qy / length, qz / length, qw / length, x, y, z])
}

pub(crate) fn solve(request: &Request) -> Result<(Solved, Timing), Failure> {
    let (poses, edges) = g2o::read(request.text("graph")?)?;
    let name = |pose: usize| format!("x{pose}");
    let linearized = Arc::new(AtomicUsize::new(0));
    let (mut problem, mut initial) = (Problem::new(), HashMap::new());
    for (index, pose) in poses.iter().enumerate() {
        problem.set_variable_manifold(&name(index), Arc::new(SE3Manifold));
        initial.insert(name(index), parameters(pose));
    }
    let first = poses.first().ok_or("no poses")?;
    let held = Held { parameters: parameters(first), linearized: linearized.clone() };
    problem.add_residual_block(6, &[&name(0)], Box::new(held), None);
    for edge in &edges {
        problem.add_residual_block(
            6,
            &[&name(edge.from), &name(edge.to)],
            Box::new(Between::new(edge)?),
            None,
        );
    }

    let mut options = OptimizerOptions::default();
    if let Some(tolerance) = request.tolerance()? {
        options.min_rel_error_decrease_threshold = tolerance;
        options.min_abs_error_decrease_threshold = 0.0;
    }
    let options = Some(options);
    let (solved, timing) = match request.text("method")? {
        "gauss_newton" => timed(|| GaussNewtonOptimizer::new().optimize(&problem, &initial, options)),
        "levenberg_marquardt" => {
            timed(|| LevenbergMarquardtOptimizer::default().optimize(&problem, &initial, options))
        }
        other => return Err(format!("no method {other}").into()),
    };
    let solved = solved.ok_or("it found no solution")?;
    let poses: Option<Vec<[f64; 7]>> = (0..poses.len())
        .map(|index| {
            let found = solved.get(&name(index))?;
            Some([4, 5, 6, 0, 1, 2, 3].map(|k| found[k]))
        })
        .collect();
    let solved =
        Solved { iterations: linearized.load(Ordering::Relaxed), poses: poses.ok_or("poses are missing")? };
    Ok((solved, timing))
}

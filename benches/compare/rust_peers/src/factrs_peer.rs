use std::cell::Cell;
use std::rc::Rc;

use factrs::containers::{Graph, Values};
use factrs::optimizers::{
    BaseOptParams, GaussNewton, LevenMarquardt, LevenParams, OptError, OptObserver, Optimizer,
};
use factrs::utils::load_g20;
use factrs::variables::SE3;

use crate::Failure;
use crate::request::Request;
use crate::solved::Solved;
use crate::timing::{Timing, timed};

/// Counts the optimizer's steps.
struct Steps(Rc<Cell<usize>>);

impl OptObserver for Steps {
    fn on_step(&self, _: &Values, _: i64) {
        self.0.set(self.0.get() + 1);
    }
}

/// Solves a graph read by the library's own function, which adds a prior on the first pose.
pub(crate) fn solve(request: &Request) -> Result<(Solved, Timing), Failure> {
    let (graph, initial) = load_g20(request.text("graph")?);
    let defaults = BaseOptParams::default();
    let base = match request.tolerance()? {
        Some(tolerance) => {
            BaseOptParams { error_tol_relative: tolerance, error_tol_absolute: 0.0, ..defaults }
        }
        None => defaults,
    };
    match request.text("method")? {
        "gauss_newton" => optimize::<GaussNewton>(base, graph, initial),
        "levenberg_marquardt" => {
            optimize::<LevenMarquardt>(LevenParams { base, ..LevenParams::default() }, graph, initial)
        }
        other => Err(format!("no method {other}").into()),
    }
}

fn optimize<O: Optimizer>(
    params: O::Params,
    graph: Graph,
    initial: Values,
) -> Result<(Solved, Timing), Failure> {
    let steps = Rc::new(Cell::new(0));
    let (result, timing) = timed(|| {
        let mut optimizer = O::new(params, graph);
        optimizer.add_observer(Steps(steps.clone()));
        optimizer.optimize(initial)
    });
    let values = match result {
        Ok(values) | Err(OptError::MaxIterations(values)) => values,
        Err(error) => return Err(format!("{error:?}").into()),
    };
    let poses = values.filter::<SE3>().map(|pose| {
        let (xyz, rotation) = (pose.xyz(), pose.rot());
        [xyz[0], xyz[1], xyz[2], rotation.x(), rotation.y(), rotation.z(), rotation.w()]
    });
    Ok((Solved { iterations: steps.get(), poses: poses.collect() }, timing))
}

use std::collections::BTreeMap;

use dymlm_refine::{PoseGraph, RelativePose, SolverConfig};
use dymlm_test_support::{MeasuredPose, read_g2o};

use crate::Failure;
use crate::request::Request;
use crate::results::write_numbers;
use crate::timing::{Timing, timed};

/// Pose graphs by the paths of their files.
pub(crate) type PoseGraphs = BTreeMap<String, PoseGraph>;

/// `pose_graph graph=`: finds the poses of least cost, with default settings.
pub(crate) fn run(request: &Request, graphs: &mut PoseGraphs) -> Result<Timing, Failure> {
    let path = request.text("graph")?;
    if !graphs.contains_key(path) {
        graphs.insert(path.to_owned(), read(path)?);
    }
    let graph = graphs.get(path).ok_or("no graph")?;
    let (solution, timing) = timed(|| graph.optimize(&SolverConfig::default()));
    let solution = solution?;
    if let Some(path) = request.result() {
        let poses =
            solution.poses.iter().flat_map(|pose| pose.translation().into_iter().chain(pose.quaternion()));
        let numbers: Vec<f64> = [solution.iterations as f64].into_iter().chain(poses).collect();
        write_numbers(path, &numbers)?;
    }
    Ok(timing)
}

fn read(path: &str) -> Result<PoseGraph, Failure> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let (poses, edges) = read_g2o(&text);
    let mut graph = PoseGraph::new(poses);
    for MeasuredPose { from, to, measured, information } in edges {
        graph.add_relative(&RelativePose { from, to, measured, information })?;
    }
    Ok(graph)
}

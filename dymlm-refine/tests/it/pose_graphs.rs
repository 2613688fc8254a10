//! The field's pose graphs, held against GTSAM's optimum.
use dymlm_refine::{PoseGraph, RelativePose, SolverConfig};
use dymlm_test_support::{MeasuredPose, read_g2o, recording};

/// `gtsam.LevenbergMarquardtOptimizer` (`PyPI`, gtsam 4.2) with a prior of 1e-4 on the first pose.
#[test]
fn reaches_the_optimum_of_gtsam() {
    for (name, initial, optimum) in
        [("parking-garage", 8_363.601_948, 0.634_192_399), ("sphere2500", 1_305_657.711_8, 675.700_962_96)]
    {
        let Some(path) = recording(&format!("pose_graphs/{name}.g2o")) else { return };
        let (poses, edges) = read_g2o(&std::fs::read_to_string(path).unwrap());
        let mut graph = PoseGraph::new(poses);
        for MeasuredPose { from, to, measured, information } in edges {
            graph.add_relative(&RelativePose { from, to, measured, information }).unwrap();
        }
        let begin = std::time::Instant::now();
        let solution = graph.optimize(&SolverConfig::default()).unwrap();
        println!("{name}: {} iterations, {:?}", solution.iterations, begin.elapsed());
        assert!(solution.has_converged);
        assert!((solution.initial_cost / initial - 1.0).abs() < 1e-6, "{}", solution.initial_cost);
        assert!((solution.final_cost / optimum - 1.0).abs() < 1e-3, "{}", solution.final_cost);
    }
}

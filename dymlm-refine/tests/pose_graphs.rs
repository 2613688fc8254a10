//! The field's pose graphs, held against GTSAM's optimum.
#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_core::Pose;
use dymlm_refine::{PoseGraph, RelativePose, SolverConfig};
use dymlm_test_support::recording;

/// A file of g2o: `VERTEX_SE3:QUAT` and `EDGE_SE3:QUAT`, whose information has the translation first.
fn read_g2o(text: &str) -> (Vec<Pose>, Vec<RelativePose>) {
    let (mut poses, mut relatives) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next().unwrap_or_default();
        let numbers: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        let pose = |n: &[f64]| Pose::new([n[0], n[1], n[2]], [n[3], n[4], n[5], n[6]]).unwrap();
        match kind {
            "VERTEX_SE3:QUAT" => poses.push(pose(&numbers[1..])),
            "EDGE_SE3:QUAT" => {
                let mut upper = numbers[9..].iter();
                let mut information = [[0.0; 6]; 6];
                for k in 0..6 {
                    for l in k..6 {
                        let (row, column) = ((k + 3) % 6, (l + 3) % 6);
                        let number = *upper.next().unwrap();
                        (information[row][column], information[column][row]) = (number, number);
                    }
                }
                let (from, to) = (numbers[0] as usize, numbers[1] as usize);
                relatives.push(RelativePose { from, to, measured: pose(&numbers[2..]), information });
            }
            _ => {}
        }
    }
    (poses, relatives)
}

/// `gtsam.LevenbergMarquardtOptimizer` (`PyPI`, gtsam 4.2) with a prior of 1e-4 on the first pose.
#[test]
fn reaches_the_optimum_of_gtsam() {
    for (name, initial, optimum) in
        [("parking-garage", 8_363.601_948, 0.634_192_399), ("sphere2500", 1_305_657.711_8, 675.700_962_96)]
    {
        let Some(path) = recording(&format!("pose_graphs/{name}.g2o")) else { return };
        let (poses, relatives) = read_g2o(&std::fs::read_to_string(path).unwrap());
        let mut graph = PoseGraph::new(poses);
        for relative in &relatives {
            graph.add_relative(relative).unwrap();
        }
        let begin = std::time::Instant::now();
        let solution = graph.optimize(&SolverConfig::default()).unwrap();
        println!("{name}: {} iterations, {:?}", solution.iterations, begin.elapsed());
        assert!(solution.has_converged);
        assert!((solution.initial_cost / initial - 1.0).abs() < 1e-6, "{}", solution.initial_cost);
        assert!((solution.final_cost / optimum - 1.0).abs() < 1e-3, "{}", solution.final_cost);
    }
}

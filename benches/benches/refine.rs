//! Solving for poses with planes and landmarks: rooms in a row, each with ten planes and seven objects that
//! every third pose in it has seen.
//! Also solving the field's pose graphs, where the data folder has them.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use dymlm_core::{Pose, SplitMix64};
use dymlm_refine::{LandmarkView, PlaneView, PoseGraph, RelativePose, SolverConfig};
use dymlm_test_support::{MeasuredPose, read_g2o, recording};

const POSES_IN_A_ROOM: usize = 80;
const PLANES_OF_A_ROOM: usize = 10;
const NOISE: f64 = 0.002;
const OBJECTS_OF_A_ROOM: usize = 7;
/// Errors of an object's centre across the line of sight and along it, metres.
const CENTER_NOISE: [f64; 2] = [0.03, 3.0];

fn true_pose(index: usize) -> Pose {
    let angle = index as f64 * 0.1;
    let (sin, cos) = (0.5 * angle).sin_cos();
    let room = (index / POSES_IN_A_ROOM) as f64 * 6.0;
    let place = [room + 1.5 * angle.cos(), 1.5 * angle.sin(), 0.1 * (3.0 * angle).sin()];
    Pose::new(place, [0.0, 0.0, sin, cos]).unwrap_or_default()
}

/// The view of a plane of a room: four are walls, the others are horizontal at various heights.
fn view(plane: usize, index: usize, random: &mut SplitMix64) -> PlaneView {
    let inverse = true_pose(index).inverse();
    let room = (index / POSES_IN_A_ROOM) as f64 * 6.0;
    let (center, axis) = match plane {
        0 => ([room + 3.0, 0.0, 0.0], 0),
        1 => ([room - 3.0, 0.0, 0.0], 0),
        2 => ([room, 3.0, 0.0], 1),
        3 => ([room, -3.0, 0.0], 1),
        height => ([room, 0.0, 0.3 * height as f64 - 2.2], 2),
    };
    let unit = |k: usize| [0, 1, 2].map(|l| if k == l { 1.0 } else { 0.0 });
    let [normal, a, b] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| inverse.rotate(unit(k)));
    let (center, noise) = (inverse.transform_point(center), NOISE * (random.fraction() - 0.5));
    let entry = |k: usize, l: usize| a[k] * a[l] + b[k] * b[l];
    PlaneView {
        pose: index,
        information: 1.0 / (NOISE * NOISE),
        centroid: [0, 1, 2].map(|k| center[k] + noise * normal[k]),
        covariance: [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)],
    }
}

/// The view of an object of a room: they stand in a circle around its middle.
fn object_view(object: usize, index: usize, random: &mut SplitMix64) -> LandmarkView {
    let room = (index / POSES_IN_A_ROOM) as f64 * 6.0;
    let (sin, cos) = (object as f64 * 0.9).sin_cos();
    let seen = true_pose(index).inverse().transform_point([room + 2.5 * cos, 2.5 * sin, -0.5]);
    let distance = seen.iter().map(|c| c * c).sum::<f64>().sqrt();
    let ray = seen.map(|c| c / distance);
    let [across, along] = CENTER_NOISE.map(|deviation| deviation * deviation);
    let entry = |k: usize, l: usize| if k == l { across } else { 0.0 } + (along - across) * ray[k] * ray[l];
    let place = seen.map(|c| c + CENTER_NOISE[0] * (random.fraction() - 0.5));
    LandmarkView { pose: index, place, covariance: [0, 1, 2].map(|k| [0, 1, 2].map(|l| entry(k, l))) }
}

fn graph(poses: usize) -> PoseGraph {
    let mut random = SplitMix64::new(7);
    let mut drifted = vec![true_pose(0)];
    for index in 1..poses {
        let mut small = || 0.01 * (random.fraction() - 0.5);
        let error = Pose::new([small(), small(), small()], [small(), small(), small(), 1.0]);
        let step = true_pose(index - 1).inverse() * true_pose(index) * error.unwrap_or_default();
        drifted.push(drifted[index - 1] * step);
    }
    let mut graph = PoseGraph::new(drifted.iter().copied());
    for (from, pair) in drifted.windows(2).enumerate() {
        let measured = pair[0].inverse() * pair[1];
        let relative = RelativePose::with_deviations(from, from + 1, measured, 0.006, 0.006);
        assert!(graph.add_relative(&relative).is_ok());
    }
    for room in 0..poses.div_ceil(POSES_IN_A_ROOM) {
        for plane in 0..PLANES_OF_A_ROOM {
            let seen =
                (room * POSES_IN_A_ROOM..poses.min((room + 1) * POSES_IN_A_ROOM)).skip(plane % 3).step_by(3);
            let views: Vec<PlaneView> = seen.map(|index| view(plane, index, &mut random)).collect();
            assert!(graph.add_plane(&views).is_ok());
        }
        for object in 0..OBJECTS_OF_A_ROOM {
            let seen = (room * POSES_IN_A_ROOM..poses.min((room + 1) * POSES_IN_A_ROOM)).skip(object % 3);
            let views = seen.step_by(3).map(|index| object_view(object, index, &mut random));
            assert!(graph.add_landmark(&views.collect::<Vec<_>>()).is_ok());
        }
    }
    graph
}

fn solve(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-refine/optimize");
    group.sample_size(10);
    for poses in [500, 5000] {
        let graph = graph(poses);
        group.bench_function(BenchmarkId::from_parameter(poses), |bencher| {
            bencher.iter(|| graph.optimize(&SolverConfig::default()).map(|solution| solution.final_cost));
        });
    }
}

fn solve_pose_graphs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-refine/pose_graph");
    group.sample_size(10);
    for name in ["parking-garage", "sphere2500"] {
        let path = recording(&format!("pose_graphs/{name}.g2o"));
        let Some(text) = path.and_then(|path| std::fs::read_to_string(path).ok()) else { continue };
        let (poses, edges) = read_g2o(&text);
        let mut graph = PoseGraph::new(poses);
        for MeasuredPose { from, to, measured, information } in edges {
            assert!(graph.add_relative(&RelativePose { from, to, measured, information }).is_ok());
        }
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| graph.optimize(&SolverConfig::default()).map(|solution| solution.final_cost));
        });
    }
}

criterion_group!(benches, solve, solve_pose_graphs);
criterion_main!(benches);

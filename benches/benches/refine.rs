//! Solving for poses with planes and landmarks: rooms with ten planes and seven objects each, which every
//! third pose in them has seen; in a row, as a building in which each room is entered twice, and as one hall
//! whose 60 planes and 40 objects are seen all the time. Also solving the field's pose graphs, where the data
//! folder has them.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use dymlm_core::{Pose, SplitMix64};
use dymlm_refine::{LandmarkView, PlaneView, PoseGraph, RelativePose, SolverConfig};
use dymlm_test_support::{MeasuredPose, read_g2o, recording};

const POSES_IN_A_ROOM: usize = 80;
/// Of a plane's mean distance, metres.
const NOISE: f64 = 0.002;
/// Errors of an object's centre across the line of sight and along it, metres.
const CENTER_NOISE: [f64; 2] = [0.03, 3.0];

/// A problem of so many poses.
#[derive(Clone, Copy)]
struct Problem {
    poses: usize,
    rooms: usize,
    /// Rooms beside each other, before the next row begins.
    rooms_in_a_row: usize,
    /// Planes and objects of each room.
    things: [usize; 2],
    /// Errors of the odometry from pose to pose: of the rotation's quaternion and of the translation.
    drift: [f64; 2],
    /// The floor is one plane in all rooms, errors are Gaussian, and one view of a plane in 70 is of another
    /// plane: what `MapBuilder::refine_poses` meets in a simulated building of 12 rooms.
    is_real: bool,
}

impl Problem {
    /// Rooms one after the other. Nothing is seen again.
    fn row(poses: usize) -> Self {
        let rooms = poses.div_ceil(POSES_IN_A_ROOM);
        let (rooms_in_a_row, drift) = (rooms, [0.01; 2]);
        Self { poses, rooms, rooms_in_a_row, things: [10, 7], drift, is_real: false }
    }

    /// A square of rooms; all are entered again, in the opposite order. Odometry has the errors of
    /// `RefineConfig` at 3 key frames a second.
    fn building(poses: usize) -> Self {
        let rooms = poses.div_ceil(2 * POSES_IN_A_ROOM);
        let rooms_in_a_row = (rooms as f64).sqrt().ceil() as usize;
        Self { poses, rooms, rooms_in_a_row, things: [10, 7], drift: [0.003, 0.01], is_real: true }
    }

    /// One room with everything in it.
    fn hall(poses: usize) -> Self {
        Self { poses, rooms: 1, rooms_in_a_row: 1, things: [60, 40], drift: [0.003, 0.01], is_real: false }
    }

    fn room(&self, index: usize) -> usize {
        let stay = if self.rooms == 1 { 0 } else { index / POSES_IN_A_ROOM };
        if stay < self.rooms { stay } else { (2 * self.rooms).saturating_sub(stay + 1) }
    }

    /// The middle of the room of a pose.
    fn middle(&self, index: usize) -> [f64; 2] {
        let (row, place) = (self.room(index) / self.rooms_in_a_row, self.room(index) % self.rooms_in_a_row);
        let place = if row % 2 == 0 { place } else { self.rooms_in_a_row - 1 - place };
        [6.0 * place as f64, 6.0 * row as f64]
    }

    fn true_pose(&self, index: usize) -> Pose {
        let angle = index as f64 * 0.1;
        let (sin, cos) = (0.5 * angle).sin_cos();
        let [x, y] = self.middle(index);
        let place = [x + 1.5 * angle.cos(), y + 1.5 * angle.sin(), 0.1 * (3.0 * angle).sin()];
        Pose::new(place, [0.0, 0.0, sin, cos]).unwrap_or_default()
    }

    /// An error of about one standard deviation.
    fn error(&self, random: &mut SplitMix64) -> f64 {
        if self.is_real {
            (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0
        } else {
            random.fraction() - 0.5
        }
    }

    /// The view of a plane of a room: four are walls, the others are horizontal at various heights.
    fn view(&self, plane: usize, index: usize, random: &mut SplitMix64) -> PlaneView {
        let inverse = self.true_pose(index).inverse();
        let [x, y] = self.middle(index);
        let (center, axis) = match plane {
            0 => ([x + 3.0, y, 0.0], 0),
            1 => ([x - 3.0, y, 0.0], 0),
            2 => ([x, y + 3.0, 0.0], 1),
            3 => ([x, y - 3.0, 0.0], 1),
            height => ([x, y, 0.3 * height as f64 - 2.2], 2),
        };
        let unit = |k: usize| [0, 1, 2].map(|l| if k == l { 1.0 } else { 0.0 });
        let [normal, a, b] = [axis, (axis + 1) % 3, (axis + 2) % 3].map(|k| inverse.rotate(unit(k)));
        let is_of_another = self.is_real && random.fraction() < 1.0 / 70.0;
        let off = NOISE * self.error(random) + if is_of_another { 0.06 } else { 0.0 };
        let center = inverse.transform_point(center);
        let entry = |k: usize, l: usize| a[k] * a[l] + b[k] * b[l];
        PlaneView {
            pose: index,
            information: 1.0 / (NOISE * NOISE),
            centroid: [0, 1, 2].map(|k| center[k] + off * normal[k]),
            covariance: [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)],
        }
    }

    /// The view of an object of a room: they stand in a circle around its middle.
    fn object_view(&self, object: usize, index: usize, random: &mut SplitMix64) -> LandmarkView {
        let ([x, y], (sin, cos)) = (self.middle(index), (object as f64 * 0.9).sin_cos());
        let seen = self.true_pose(index).inverse().transform_point([x + 2.5 * cos, y + 2.5 * sin, -0.5]);
        let distance = seen.iter().map(|c| c * c).sum::<f64>().sqrt();
        let ray = seen.map(|c| c / distance);
        let [across, along] = CENTER_NOISE.map(|deviation| deviation * deviation);
        let entry =
            |k: usize, l: usize| if k == l { across } else { 0.0 } + (along - across) * ray[k] * ray[l];
        let place = seen.map(|c| c + CENTER_NOISE[0] * self.error(random));
        LandmarkView { pose: index, place, covariance: [0, 1, 2].map(|k| [0, 1, 2].map(|l| entry(k, l))) }
    }

    fn graph(&self) -> PoseGraph {
        let mut random = SplitMix64::new(7);
        let mut drifted = vec![self.true_pose(0)];
        for index in 1..self.poses {
            let [turn, shift] = self.drift.map(|error| [(); 3].map(|()| error * (random.fraction() - 0.5)));
            let error = Pose::new(shift, [turn[0], turn[1], turn[2], 1.0]).unwrap_or_default();
            let step = self.true_pose(index - 1).inverse() * self.true_pose(index) * error;
            drifted.push(drifted[index - 1] * step);
        }
        let mut graph = PoseGraph::new(drifted.iter().copied());
        let [turn, shift] = self.drift.map(|error| 0.6 * error);
        for (from, pair) in drifted.windows(2).enumerate() {
            let measured = pair[0].inverse() * pair[1];
            let relative = RelativePose::with_deviations(from, from + 1, measured, turn, shift);
            assert!(graph.add_relative(&relative).is_ok());
        }
        let mut poses_in: Vec<Vec<usize>> = vec![Vec::new(); self.rooms];
        for index in 0..self.poses {
            poses_in[self.room(index)].push(index);
        }
        let third =
            |poses: &[usize], thing: usize| poses.iter().copied().skip(thing % 3).step_by(3).collect();
        let (everywhere, floor) = ((0..self.poses).collect::<Vec<_>>(), self.is_real.then_some(4));
        let add_plane = |plane: usize, poses: Vec<usize>, random: &mut SplitMix64, graph: &mut PoseGraph| {
            let views: Vec<PlaneView> =
                poses.into_iter().map(|index| self.view(plane, index, random)).collect();
            assert!(graph.add_plane(&views).is_ok());
        };
        if let Some(floor) = floor {
            add_plane(floor, third(&everywhere, floor), &mut random, &mut graph);
        }
        let [planes, objects] = self.things;
        for poses in &poses_in {
            for plane in (0..planes).filter(|plane| Some(*plane) != floor) {
                add_plane(plane, third(poses, plane), &mut random, &mut graph);
            }
            for object in 0..objects {
                let seen: Vec<usize> = third(poses, object);
                let views = seen.into_iter().map(|index| self.object_view(object, index, &mut random));
                assert!(graph.add_landmark(&views.collect::<Vec<_>>()).is_ok());
            }
        }
        graph
    }
}

fn solve(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-refine/optimize");
    group.sample_size(10);
    for poses in [500, 5000] {
        let (row, building, hall) = (Problem::row(poses), Problem::building(poses), Problem::hall(poses));
        for (name, problem) in [("row", row), ("building", building), ("hall", hall)] {
            let graph = problem.graph();
            group.bench_function(BenchmarkId::new(name, poses), |bencher| {
                bencher.iter(|| graph.optimize(&SolverConfig::default()).map(|solution| solution.final_cost));
            });
        }
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

//! Landmarks hold what planes do not, and nothing else.
use dymlm_core::{Pose, SplitMix64};
use dymlm_refine::{Error, LandmarkView, PlaneView, PoseGraph, RelativePose, SolverConfig};

/// Deviations of a place across the line of sight and along it, metres: the far side of a thing is not seen.
const ACROSS: f64 = 0.02;
const ALONG: f64 = 0.15;
/// Of a plane's mean distance, metres.
const NOISE: f64 = 0.002;
const LENGTH: f64 = 20.0;

/// To the end of a corridor along x and back: cameras look the way they go.
fn there_and_back(count: usize) -> Vec<Pose> {
    let pose = |k: usize| {
        let share = 2.0 * k as f64 / count as f64;
        let quaternion = if share < 1.0 { [0.5, -0.5, 0.5, -0.5] } else { [0.5, 0.5, -0.5, -0.5] };
        let x = LENGTH * if share < 1.0 { share } else { 2.0 - share };
        Pose::new([x, 0.2 * (3.0 * share).sin(), 0.0], quaternion).unwrap()
    };
    (0..count).map(pose).collect()
}

fn drifted(truth: &[Pose], random: &mut SplitMix64) -> Vec<Pose> {
    let mut poses = vec![truth[0]];
    for pair in truth.windows(2) {
        let mut small = || 0.01 * (random.fraction() - 0.5);
        let error =
            Pose::new([small(), small(), 3.0 * small()], [0.3 * small(), small(), small(), 1.0]).unwrap();
        poses.push(poses[poses.len() - 1] * pair[0].inverse() * pair[1] * error);
    }
    poses
}

/// Odometry, and both walls and the floor of the corridor.
fn corridor(poses: &[Pose], truth: &[Pose], random: &mut SplitMix64) -> PoseGraph {
    let mut graph = PoseGraph::new(poses.iter().copied());
    for (from, pair) in poses.windows(2).enumerate() {
        let measured = pair[0].inverse() * pair[1];
        graph.add_relative(&RelativePose::with_deviations(from, from + 1, measured, 0.006, 0.01)).unwrap();
    }
    for (place, normal) in [(1.2, [0.0, 1.0, 0.0]), (-1.2, [0.0, 1.0, 0.0]), (-1.0, [0.0, 0.0, 1.0])] {
        let view = |(pose, at): (usize, &Pose)| {
            let noise = NOISE * 3.4 * (random.fraction() - 0.5);
            let [x, _, _] = at.translation();
            let center = [0, 1, 2].map(|k| (place + noise) * normal[k] + if k == 0 { x } else { 0.0 });
            let inverse = at.inverse();
            let across = [normal[2], 0.0, normal[1]].map(|c| c * 0.5);
            let [a, b] =
                [[1.0, 0.0, 0.0], [0.0, across[0] * 2.0, across[2] * 2.0]].map(|v| inverse.rotate(v));
            let entry = |k: usize, l: usize| (a[k] * a[l] + b[k] * b[l]) / 3.0;
            let covariance = [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
            let centroid = inverse.transform_point(center);
            PlaneView { pose, information: 1.0 / (NOISE * NOISE), centroid, covariance }
        };
        let views: Vec<_> = truth.iter().enumerate().map(view).collect();
        graph.add_plane(&views).unwrap();
    }
    graph
}

/// What a pose sees of a thing, with noise; `None` when it is not before the camera or too far.
fn view(thing: [f64; 3], pose: usize, at: &Pose, random: &mut SplitMix64) -> Option<LandmarkView> {
    let place = at.inverse().transform_point(thing);
    let distance = place.iter().map(|c| c * c).sum::<f64>().sqrt();
    let ray = place.map(|c| c / distance);
    if place[2] < 0.5 * distance || distance > 4.0 {
        return None;
    }
    let mut normal = || (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0;
    let (noise, along) = ([0; 3].map(|_| ACROSS * normal()), ALONG * normal());
    let off = along - (0..3).map(|k| noise[k] * ray[k]).sum::<f64>();
    let [across, own] = [ACROSS * ACROSS, ALONG * ALONG];
    let entry = |k: usize, l: usize| if k == l { across } else { 0.0 } + (own - across) * ray[k] * ray[l];
    Some(LandmarkView {
        pose,
        place: [0, 1, 2].map(|k| place[k] + noise[k] + off * ray[k]),
        covariance: [0, 1, 2].map(|k| [0, 1, 2].map(|l| entry(k, l))),
    })
}

fn things() -> Vec<[f64; 3]> {
    (0..14_i32).map(|k| [1.4 * f64::from(k) + 0.7, if k % 2 == 0 { 0.9 } else { -0.9 }, -0.6]).collect()
}

fn views(thing: [f64; 3], truth: &[Pose], random: &mut SplitMix64) -> Vec<LandmarkView> {
    truth.iter().enumerate().filter_map(|(index, pose)| view(thing, index, pose, random)).collect()
}

fn error(poses: &[Pose], truth: &[Pose]) -> f64 {
    let squares = poses.iter().zip(truth).map(|(pose, true_pose)| pose.distance(true_pose).powi(2));
    (squares.sum::<f64>() / poses.len() as f64).sqrt()
}

/// Deviation along the corridor.
fn deviation(graph: &PoseGraph, solution: &dymlm_refine::Solution, pose: usize) -> f64 {
    let covariance = graph.covariances(solution, &[pose]).unwrap()[0];
    let axis = solution.poses[pose].inverse().rotate([1.0, 0.0, 0.0]);
    let terms = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
    terms.map(|(k, l)| axis[k] * covariance[3 + k][3 + l] * axis[l]).sum::<f64>().sqrt()
}

/// Walls and floor say nothing of the way along a corridor: what stands in it does.
#[test]
fn landmarks_hold_the_way_along_a_corridor() {
    let mut errors = [0.0; 2];
    for seed in 1..=6 {
        let (mut random, truth) = (SplitMix64::new(seed), there_and_back(200));
        let poses = drifted(&truth, &mut random);
        let mut graph = corridor(&poses, &truth, &mut random);
        let without = graph.optimize(&SolverConfig::default()).unwrap();
        let before = deviation(&graph, &without, 199);
        for thing in things() {
            graph.add_landmark(&views(thing, &truth, &mut random)).unwrap();
        }
        let with = graph.optimize(&SolverConfig::default()).unwrap();
        let after = deviation(&graph, &with, 199);
        assert!(with.has_converged && after < 0.3 * before, "{before} {after}");
        // Back at the start; how far the end of the corridor is, they cannot tell.
        for (sum, solution) in errors.iter_mut().zip([&without, &with]) {
            *sum += solution.poses[199].distance(&truth[199]).powi(2);
        }
    }
    assert!(errors[1] < 0.35 * errors[0], "{errors:?}");
}

/// A third of the views of some things are of their neighbours: they are named, and do not pull.
#[test]
fn views_of_another_thing_are_left_out() {
    for seed in [4, 5, 6] {
        let (mut random, truth) = (SplitMix64::new(seed), there_and_back(200));
        let poses = drifted(&truth, &mut random);
        let mut all = corridor(&poses, &truth, &mut random);
        let mut right = all.clone();
        let mut wrong = Vec::new();
        for (number, thing) in things().into_iter().enumerate() {
            let mut seen = views(thing, &truth, &mut random);
            let others = if number % 3 == 1 { 3 } else { usize::MAX };
            let is_wrong = |place: usize| place % others == others - 1;
            let right_views: Vec<_> = seen
                .iter()
                .enumerate()
                .filter(|(place, _)| !is_wrong(*place))
                .map(|(_, view)| *view)
                .collect();
            for (place, view) in seen.iter_mut().enumerate().filter(|(place, _)| is_wrong(*place)) {
                let off = truth[view.pose].inverse().rotate([0.5, 0.4, 0.0]);
                view.place = [0, 1, 2].map(|k| view.place[k] + off[k]);
                wrong.push([number, place]);
            }
            all.add_landmark(&seen).unwrap();
            right.add_landmark(&right_views).unwrap();
        }
        let config = SolverConfig::default();
        let (all, right) = (all.optimize(&config).unwrap(), right.optimize(&config).unwrap());
        let missed = wrong.iter().filter(|view| !all.landmark_views_left_out.contains(view)).count();
        assert!(missed == 0, "{missed} of {}", wrong.len());
        // One right view in a thousand is beyond the gate.
        assert!(
            all.landmark_views_left_out.len() <= wrong.len() + 6 && right.landmark_views_left_out.len() <= 6
        );
        assert!(error(&all.poses, &right.poses) < 0.01, "{}", error(&all.poses, &right.poses));
    }
}

/// However far off one view is, it alone goes.
#[test]
fn an_absurd_view_takes_no_right_one_with_it() {
    for (seed, far) in [(1, 10.0), (2, 1e3), (3, 1e6), (4, 1e9)] {
        let (mut random, truth) = (SplitMix64::new(seed), there_and_back(200));
        let poses = drifted(&truth, &mut random);
        let mut all = corridor(&poses, &truth, &mut random);
        let mut right = all.clone();
        for (number, thing) in things().into_iter().enumerate() {
            let mut seen = views(thing, &truth, &mut random);
            let mut right_views = seen.clone();
            if number == 5 {
                seen[3].place[0] += far;
                right_views.remove(3);
            }
            all.add_landmark(&seen).unwrap();
            right.add_landmark(&right_views).unwrap();
        }
        let config = SolverConfig::default();
        let (all, right) = (all.optimize(&config).unwrap(), right.optimize(&config).unwrap());
        let others = |left_out: &[[usize; 2]]| left_out.iter().filter(|view| **view != [5, 3]).count();
        println!("{far} m: {} steps", all.iterations);
        assert!(all.landmark_views_left_out.contains(&[5, 3]), "{far} m");
        // One right view in a thousand is beyond the gate.
        assert!(others(&all.landmark_views_left_out) <= 6, "{far} m: {:?}", all.landmark_views_left_out);
        assert!(all.views_left_out.len() <= 3 && right.landmark_views_left_out.len() <= 6, "{far} m");
        assert!(error(&all.poses, &right.poses) < 0.01, "{far} m: {}", error(&all.poses, &right.poses));
    }
}

#[test]
fn what_one_pose_has_seen_changes_nothing() {
    let (mut random, truth) = (SplitMix64::new(7), there_and_back(40));
    let poses = drifted(&truth, &mut random);
    let graph = corridor(&poses, &truth, &mut random);
    let mut with = graph.clone();
    let seen = view([2.0, 0.9, -0.6], 0, &truth[0], &mut random).unwrap();
    for views in [&[][..], &[seen], &[seen; 3]] {
        with.add_landmark(views).unwrap();
    }
    let config = SolverConfig::default();
    assert_eq!(graph.optimize(&config), with.optimize(&config));
    // All of it is refused when one view is.
    let unknown = LandmarkView { pose: 40, ..seen };
    assert_eq!(with.add_landmark(&[seen, unknown]), Err(Error::UnknownPose { pose: 40, poses: 40 }));
    let nothing = LandmarkView { covariance: [[f64::NAN; 3]; 3], ..seen };
    assert!(matches!(with.add_landmark(&[seen, nothing]), Err(Error::NoInformation { .. })));
    assert_eq!(graph.optimize(&config), with.optimize(&config));
}

//! Whatever the numbers, there is an answer or an error.
use dymlm_core::Pose;
use dymlm_refine::{LandmarkView, PlaneView, PoseGraph, RelativePose, SolverConfig};
use proptest::prelude::*;

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -3.0..3.0_f64,
        1 => prop::sample::select(vec![0.0, 1e-300, 1e-12, 1e6, 1e12, 1e150, -1e150, 1e300, f64::MAX]),
    ]
}

fn pose() -> impl Strategy<Value = Pose> {
    let quaternion = prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a direction", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.1);
    (prop::array::uniform3(number()), quaternion).prop_map(|(translation, q)| {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        Pose::new(translation, q.map(|x| x / norm)).unwrap_or_default()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_numbers_panic(
        poses in prop::collection::vec(pose(), 0..6),
        relatives in prop::collection::vec((0..7_usize, 0..7_usize, pose(), number(), number(), any::<bool>()), 0..8),
        views in prop::collection::vec((0..7_usize, number(), prop::array::uniform3(number()), prop::array::uniform6(number())), 0..8),
        landmarks in prop::collection::vec((0..7_usize, number(), prop::array::uniform3(number()), prop::array::uniform6(number())), 0..8),
    ) {
        let mut graph = PoseGraph::new(poses.iter().copied());
        for (from, to, measured, rotation, translation, is_closure) in relatives {
            let relative = RelativePose::with_deviations(from, to, measured, rotation, translation);
            let added = if is_closure { graph.add_loop_closure(&relative) } else { graph.add_relative(&relative) };
            prop_assert!(added.is_ok() || from.max(to) >= poses.len() || from == to || rotation.abs().min(translation.abs()) < 1e-100 || rotation.abs().max(translation.abs()) > 1e100);
        }
        let view = |(pose, information, centroid, [xx, xy, xz, yy, yz, zz]): (_, f64, _, [f64; 6])| PlaneView {
            pose,
            information: information.abs(),
            centroid,
            // Most are covariances.
            covariance: [xx.abs(), 0.1 * xy, 0.1 * xz, yy.abs(), 0.1 * yz, zz.abs()],
        };
        let views: Vec<PlaneView> = views.into_iter().map(view).collect();
        for views in views.chunks(3) {
            graph.add_plane(views).ok();
        }
        let landmark = |(pose, variance, place, [xx, xy, xz, yy, yz, zz]): (_, f64, _, [f64; 6])| LandmarkView {
            pose,
            place,
            // Most are covariances.
            covariance: [
                [xx.abs() + variance.abs(), 0.1 * xy, 0.1 * xz],
                [0.1 * xy, yy.abs() + variance.abs(), 0.1 * yz],
                [0.1 * xz, 0.1 * yz, zz.abs() + variance.abs()],
            ],
        };
        let landmarks: Vec<LandmarkView> = landmarks.into_iter().map(landmark).collect();
        for views in landmarks.chunks(3) {
            graph.add_landmark(views).ok();
        }
        let mut config = SolverConfig::default();
        config.max_iterations = 10;
        if let Ok(solution) = graph.optimize(&config) {
            prop_assert_eq!(solution.poses.len(), poses.len());
            let worse = solution.final_cost > solution.initial_cost * (1.0 + 1e-9);
            // Loop closures that are weighed less never make the cost greater.
            prop_assert!(!worse || !solution.initial_cost.is_finite(), "{:?}", solution);
            if let (Some(first), Some(given)) = (solution.poses.first(), poses.first()) {
                prop_assert!(first.distance(given) <= 1e-9 * (1.0 + given.translation().iter().map(|c| c.abs()).sum::<f64>()));
            }
        }
    }
}

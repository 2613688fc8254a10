//! Poses from points, from pixels, and from both.

use dymlm_core::{PinholeCamera, Pose};
use dymlm_tracking::{PoseObservation, PoseRansac, PoseRefiner, RansacConfig, RobustKernel, p3p};
use proptest::prelude::*;

fn pose() -> impl Strategy<Value = Pose> {
    let quaternion = prop::array::uniform4(-1.0..1.0_f64)
        .prop_filter("a direction", |q| q.iter().map(|x| x * x).sum::<f64>() > 0.1);
    (prop::array::uniform3(-0.5..0.5_f64), 0.6..4.0_f64, quaternion).prop_map(|([x, y, _], z, q)| {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        Pose::new([x, y, z], q.map(|x| x / norm)).unwrap()
    })
}

fn points(count: usize) -> impl Strategy<Value = Vec<[f64; 3]>> {
    prop::collection::vec(prop::array::uniform3(-0.2..0.2_f64), count)
}

fn camera() -> PinholeCamera {
    PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap()
}

/// A fixed, irregular sequence in -1..1.
fn noise(i: usize) -> f64 {
    ((i as f64 * 12.9898).sin() * 43758.5453).fract()
}

/// Twice the area of a triangle over its longest side squared.
fn fatness(points: &[[f64; 3]]) -> f64 {
    let d = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let (u, v) = (d(points[0], points[1]), d(points[0], points[2]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = |x: [f64; 3]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    length(cross) / length(u).max(length(v)).powi(2).max(1e-12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn p3p_finds_the_pose_among_its_solutions(truth in pose(), body in points(3)) {
        prop_assume!(fatness(&body) > 0.05 && body.iter().all(|&p| truth.transform_point(p)[2] > 0.1));
        let rays: [[f64; 3]; 3] = std::array::from_fn(|i| truth.transform_point(body[i]));
        let body: [[f64; 3]; 3] = std::array::from_fn(|i| body[i]);
        let poses = p3p(&rays, &body);
        prop_assert!(poses.len() <= 4);
        let nearest = poses.iter().map(|pose| pose.distance(&truth) + pose.angle(&truth)).fold(f64::INFINITY, f64::min);
        prop_assert!(nearest < 1e-4, "{nearest} of {}", poses.len());
        for pose in &poses {
            for (ray, point) in rays.iter().zip(&body) {
                let seen = pose.transform_point(*point);
                let cosine = ray.iter().zip(seen).map(|(a, b)| a * b).sum::<f64>()
                    / (ray.iter().map(|x| x * x).sum::<f64>() * seen.iter().map(|x| x * x).sum::<f64>()).sqrt();
                prop_assert!(cosine > 1.0 - 1e-8, "{cosine}");
            }
        }
    }

    #[test]
    fn pnp_survives_outliers(truth in pose(), body in points(40)) {
        let camera = camera();
        prop_assume!(body.iter().all(|&p| truth.transform_point(p)[2] > 0.3));
        let pixels: Vec<[f64; 2]> = body.iter().enumerate().map(|(i, &p)| {
            let [u, v] = camera.project(truth.transform_point(p)).unwrap();
            if i % 5 < 2 { [u + 60.0 * noise(i), v + 25.0 + 10.0 * noise(i + 100)] } else { [u, v] }
        }).collect();
        let found = PoseRansac::new(&RansacConfig::default()).unwrap().pnp(&camera, &body, &pixels).unwrap();
        prop_assert!(found.inliers.len() >= 24);
        prop_assert!(found.pose.distance(&truth) < 1e-3 && found.pose.angle(&truth) < 3e-3);
    }
}

#[test]
fn p3p_finds_the_pose_where_points_are_seen_alike() {
    // Isosceles triangles that face the camera, the one in the middle equilateral; exact, and a little off.
    for height in [0.4, 3.0_f64.sqrt(), 2.5] {
        for (depth, nudge) in
            (0..90).map(|i| (1.5 + 0.15 * f64::from(i / 3), [0.0, 1e-9, 1e-6][i as usize % 3]))
        {
            let truth = Pose::new([0.0, 0.0, depth], [0.0, 0.0, 0.0, 1.0]).unwrap();
            let body = [[0.0, height, 0.0], [1.0, nudge, 0.0], [-1.0, 0.0, nudge]];
            for first in 0..3 {
                let body = [body[first], body[(first + 1) % 3], body[(first + 2) % 3]];
                let poses = p3p(&body.map(|point| truth.transform_point(point)), &body);
                let apart = poses.iter().map(|pose| pose.distance(&truth) + pose.angle(&truth));
                let nearest = apart.fold(f64::INFINITY, f64::min);
                assert!(nearest < 1e-5, "{height} {depth} {nudge} {first}: {nearest} of {}", poses.len());
            }
        }
    }
}

#[test]
fn p3p_finds_the_pose_of_a_small_triangle_far_away() {
    let truth = Pose::new([3.0, -2.0, 200.0], [0.1, -0.2, 0.3, 0.86_f64.sqrt()]).unwrap();
    let body = [[0.0, 0.0, 0.0], [0.02, 0.0, 0.005], [0.0, 0.015, 0.0]];
    let poses = p3p(&body.map(|point| truth.transform_point(point)), &body);
    let nearest = poses.iter().map(|pose| pose.distance(&truth)).fold(f64::INFINITY, f64::min);
    assert!(nearest < 0.01, "{nearest} of {}", poses.len());
}

#[test]
fn degenerate_points_have_no_pose() {
    let line = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [3.0, 3.0, 3.0]];
    assert!(p3p(&[[0.0, 0.0, 1.0]; 3], &[line[0], line[1], line[2]]).is_empty());
    assert!(p3p(&[[f64::NAN; 3]; 3], &[[0.0; 3]; 3]).is_empty());
    assert!(p3p(&[[0.0; 3]; 3], &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).is_empty());
    let ransac = PoseRansac::new(&RansacConfig::default()).unwrap();
    assert!(ransac.align(&line, &line).is_none());
    assert!(ransac.pnp(&camera(), &[[f64::NAN; 3]; 20], &[[100.0, 100.0]; 20]).is_none());
}

#[test]
fn nan_pairs_do_not_poison_a_consensus() {
    let truth = Pose::new([0.3, 0.1, 1.0], [0.1, 0.2, 0.3, 0.927_361_85]).unwrap();
    let in_b: Vec<[f64; 3]> = (0..40).map(|i| [noise(i), noise(i + 50), noise(i + 90)]).collect();
    let mut in_a: Vec<[f64; 3]> = in_b.iter().map(|&p| truth.transform_point(p)).collect();
    in_a.iter_mut().step_by(4).for_each(|p| p[2] = f64::NAN);
    let ransac = PoseRansac::new(&RansacConfig::default()).unwrap();
    let found = ransac.align(&in_b, &in_a).unwrap();
    assert_eq!(found.inliers.len(), 30);
    assert!(found.pose.distance(&truth) < 1e-6);
    assert_eq!(ransac.align(&in_b, &in_a), Some(found));
}

/// Pixels at the pose `truth` with noise of `sigma`; each `seed` has its own noise.
fn noisy_view(truth: &Pose, sigma: f64, seed: usize) -> Vec<PoseObservation> {
    let camera = camera();
    let gauss = |i: usize| (0..12).map(|k| noise(1000 * seed + 12 * i + k)).sum::<f64>() / 2.0;
    (0..60)
        .map(|i| {
            let point = [0.1 * noise(i), 0.1 * noise(i + 70), 0.1 * noise(i + 140)];
            let [u, v] = camera.project(truth.transform_point(point)).unwrap();
            let pixel = [u + sigma * gauss(2 * i), v + sigma * gauss(2 * i + 1)];
            PoseObservation::Pixel { point, pixel, sigma }
        })
        .collect()
}

#[test]
fn the_covariance_is_that_of_repeated_measurements() {
    let truth = Pose::new([0.1, -0.05, 1.2], [0.1, 0.2, 0.3, 0.927_361_85]).unwrap();
    let refiner = PoseRefiner::new(RobustKernel::None).unwrap();
    let (mut squares, mut predicted) = (0.0, 0.0);
    for seed in 0..200 {
        let found = refiner.refine(&camera(), &truth, &noisy_view(&truth, 0.5, seed)).unwrap();
        squares += found.camera_from_body.distance(&truth).powi(2) / 200.0;
        let covariance = found.covariance.unwrap();
        predicted += (covariance[3][3] + covariance[4][4] + covariance[5][5]) / 200.0;
    }
    let ratio = squares / predicted;
    assert!((0.6..1.6).contains(&ratio), "measured over predicted variance: {ratio}");
}

#[test]
fn a_robust_kernel_ignores_what_least_squares_follows() {
    let truth = Pose::new([0.1, -0.05, 1.2], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let start = Pose::new([0.105, -0.052, 1.21], [0.01, 0.0, 0.0, 1.0]).unwrap();
    let mut seen = noisy_view(&truth, 0.3, 1);
    for observation in seen.iter_mut().step_by(5) {
        if let PoseObservation::Pixel { pixel, .. } = observation {
            pixel[0] += 30.0;
        }
    }
    let error = |kernel: RobustKernel| {
        let found = PoseRefiner::new(kernel).unwrap().refine(&camera(), &start, &seen).unwrap();
        found.camera_from_body.distance(&truth)
    };
    let [least_squares, huber, tukey] =
        [RobustKernel::None, RobustKernel::Huber(1.345), RobustKernel::Tukey(4.685)].map(error);
    assert!(
        least_squares > 0.01 && huber < 0.5 * least_squares && tukey < 0.003,
        "{least_squares} {huber} {tukey}"
    );
}

#[test]
fn depth_and_surfaces_fix_what_pixels_leave_open() {
    // The true pose is (0, 0, 1.5), not rotated.
    let start = Pose::new([0.0, 0.0, 1.6], [0.03, 0.02, 0.0, 0.9993]).unwrap();
    let refiner = PoseRefiner::new(RobustKernel::default()).unwrap();
    // A plane that faces the camera, observed only as a surface: it fixes one distance and two angles.
    let surface: Vec<_> = (0..100)
        .map(|i| {
            let point = [0.1 * noise(i), 0.1 * noise(i + 200), 0.0];
            let measured = [point[0], point[1], 1.5];
            PoseObservation::Surface { point, normal: [0.0, 0.0, -1.0], measured, sigma: 0.05 }
        })
        .collect();
    let found = refiner.refine(&camera(), &start, &surface).unwrap();
    assert!(found.covariance.is_none());
    assert!((found.camera_from_body.translation()[2] - 1.5).abs() < 1e-3);
    // The direction that the plane faces is fixed; rotations about it are free.
    assert!(found.camera_from_body.rotate([0.0, 0.0, 1.0])[2] > 1.0 - 1e-6);
    let depths: Vec<_> = (0..100)
        .map(|i| {
            let point = [0.1 * noise(i), 0.1 * noise(i + 200), 0.0];
            PoseObservation::Depth { point, depth: 1.5, sigma: 0.05 }
        })
        .collect();
    let found = refiner.refine(&camera(), &start, &depths).unwrap();
    assert!((found.camera_from_body.translation()[2] - 1.5).abs() < 1e-3);
}

#[test]
fn a_plane_may_be_measured_anywhere() {
    let truth = Pose::new([0.1, -0.05, 1.2], [0.1, -0.2, 0.3, 0.86_f64.sqrt()]).unwrap();
    let start = truth * Pose::new([0.01, -0.02, 0.01], [0.02, -0.01, 0.015, 1.0]).unwrap();
    // Three faces of a box, each known by its middle alone and measured all over.
    let on_face = |face: usize, i: usize| {
        let mut middle = [0.0; 3];
        middle[face] = 0.1;
        let mut place = middle;
        place[(face + 1) % 3] = noise(i);
        place[(face + 2) % 3] = noise(i + 300);
        let normal = middle.map(|c| 10.0 * c);
        PoseObservation::Plane { point: middle, normal, measured: truth.transform_point(place), sigma: 0.01 }
    };
    let seen: Vec<_> = (0..90).map(|i| on_face(i % 3, i)).collect();
    let found = PoseRefiner::new(RobustKernel::None).unwrap().refine(&camera(), &start, &seen).unwrap();
    assert!(found.camera_from_body.distance(&truth) < 1e-6 && found.covariance.is_some());
}

#[test]
fn unusable_observations_count_for_nothing() {
    let truth = Pose::new([0.1, -0.05, 1.2], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let refiner = PoseRefiner::new(RobustKernel::default()).unwrap();
    let clean = noisy_view(&truth, 0.3, 1);
    let mut dirty = clean.clone();
    dirty.push(PoseObservation::Pixel { point: [f64::NAN; 3], pixel: [1.0; 2], sigma: 1.0 });
    dirty.push(PoseObservation::Depth { point: [0.0; 3], depth: 1.0, sigma: 0.0 });
    dirty.push(PoseObservation::Pixel { point: [0.0, 0.0, -9.0], pixel: [1.0; 2], sigma: 1.0 });
    assert_eq!(refiner.refine(&camera(), &truth, &clean), refiner.refine(&camera(), &truth, &dirty));
    assert_eq!(refiner.refine(&camera(), &truth, &clean[..2]), None);
    assert_eq!(refiner.refine(&camera(), &truth, &[]), None);
}

#[test]
fn configs_are_checked() {
    let mut ransac = RansacConfig::default();
    ransac.max_pixels = 0.0;
    assert!(PoseRansac::new(&ransac).unwrap_err().to_string().contains("ransac.max_pixels = 0"));
    let refused = PoseRefiner::new(RobustKernel::Tukey(f64::NAN)).unwrap_err().to_string();
    assert!(refused.starts_with("kernel = NaN"), "{refused}");
}

#[test]
fn a_pose_without_inliers_does_not_end_the_search() {
    // A sample of two good pairs and a bad one may fit nothing: whatever the seed, the search must go on.
    let in_b: Vec<[f64; 3]> =
        (0..30).map(|i| [f64::from(i % 5), f64::from(i / 5), f64::from(i * i % 7)]).collect();
    let mut in_a = in_b.clone();
    in_a.iter_mut().step_by(3).for_each(|point| point[1] += 0.7);
    for seed in 0..50 {
        let mut config = RansacConfig::default();
        config.seed = seed;
        let found = PoseRansac::new(&config).unwrap().align(&in_b, &in_a);
        assert_eq!(found.map(|found| found.inliers.len()), Some(20), "seed {seed}");
    }
}

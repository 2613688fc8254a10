//! Estimated poses: they are exact by default, drift at the configured rates, and are corrected by a loop
//! closure.
use dymlm_core::{Error, PinholeCamera, Pose};
use dymlm_sim::{CameraPath, PoseErrorConfig, Sequence, SequenceConfig};
use proptest::prelude::*;

fn small_config() -> SequenceConfig {
    let mut config = SequenceConfig::default();
    config.camera = Some(PinholeCamera::new(80, 60, 65.625, 65.625, 39.5, 29.5).unwrap());
    config
}

fn drifting(seed: u64, loop_closure: Option<f64>) -> Sequence {
    let mut config = small_config();
    config.seed = seed;
    config.pose_error = PoseErrorConfig::slam();
    config.pose_error.loop_closure = loop_closure;
    Sequence::new(&config).unwrap()
}

/// Root mean square distance of some poses from the exact ones.
fn trajectory_error(sequence: &Sequence, poses: &[Pose]) -> f64 {
    let squares = poses.iter().enumerate().map(|(i, p)| p.distance(&sequence.world_from_camera(i)).powi(2));
    (squares.sum::<f64>() / poses.len() as f64).sqrt()
}

#[test]
fn without_errors_poses_are_exact_to_the_bit() {
    let mut config = small_config();
    // A loop closure without errors changes nothing either.
    config.pose_error.loop_closure = Some(3.0);
    let sequence = Sequence::new(&config).unwrap();
    let exact: Vec<Pose> = (0..150).map(|index| sequence.world_from_camera(index)).collect();
    assert_eq!(sequence.corrected_poses(usize::MAX), exact);
    assert_eq!(sequence.corrected_poses(40), exact[..=40]);
    assert_eq!(sequence.loop_closure_frame(), None);
    for (index, exact) in exact.iter().enumerate() {
        assert_eq!(sequence.estimated_pose(index), *exact);
    }
    let frame = sequence.frame(7).unwrap();
    assert_eq!(frame.estimated_world_from_camera, frame.world_from_camera);
}

#[test]
fn images_do_not_depend_on_pose_errors() {
    let (exact, drifting) = (Sequence::new(&small_config()).unwrap(), drifting(7, Some(5.0)));
    for index in [0, 30, 90] {
        let (mut a, b) = (exact.frame(index).unwrap(), drifting.frame(index).unwrap());
        assert_ne!(a.estimated_world_from_camera, b.estimated_world_from_camera);
        assert_eq!(b.estimated_world_from_camera, drifting.estimated_pose(index));
        a.estimated_world_from_camera = b.estimated_world_from_camera;
        assert_eq!(a, b);
    }
}

#[test]
fn the_relative_error_over_a_second_is_the_published_one() {
    let mut sums = [0.0; 2];
    let mut count = 0.0;
    for seed in 0..60 {
        let mut config = small_config();
        config.seed = seed;
        config.path = CameraPath::Static;
        config.pose_error = PoseErrorConfig::slam();
        let sequence = Sequence::new(&config).unwrap();
        for index in 0..140 {
            let step = |pose: &dyn Fn(usize) -> Pose| pose(index).inverse() * pose(index + 10);
            let estimated = step(&|i| sequence.estimated_pose(i));
            let exact = step(&|i| sequence.world_from_camera(i));
            sums[0] += estimated.distance(&exact).powi(2);
            sums[1] += estimated.angle(&exact).powi(2);
            count += 1.0;
        }
    }
    let [translation, rotation] = sums.map(|sum: f64| (sum / count).sqrt());
    // DS-SLAM on walking_static: 0.0102 m and 0.269 degrees a second. (Over only two knots, a smooth walk
    // drifts a little less than a rough one.)
    assert!((0.008..0.0125).contains(&translation), "{translation} m");
    assert!((0.21..0.33).contains(&rotation.to_degrees()), "{} degrees", rotation.to_degrees());
}

#[test]
fn a_loop_closure_brings_the_error_down_in_all_frames() {
    let mut before = 0.0;
    let mut after = 0.0;
    for seed in 0..40 {
        let sequence = drifting(seed, Some(12.0));
        assert_eq!(sequence.loop_closure_frame(), Some(120));
        // The closure removes the drift, not the jitter of the frame.
        let exact = sequence.world_from_camera(120);
        assert!(sequence.estimated_pose(120).distance(&exact) < 0.005);
        assert!(sequence.estimated_pose(120).angle(&exact) < 0.0025);

        let (known_before, known_after) = (sequence.corrected_poses(119), sequence.corrected_poses(120));
        assert_eq!((known_before.len(), known_after.len()), (120, 121));
        before += trajectory_error(&sequence, &known_before).powi(2);
        after += trajectory_error(&sequence, &known_after).powi(2);

        // Before the closure, the back end's poses are the front end's estimates; after it, both have the
        // same corrected poses.
        let said: Vec<Pose> = (0..120).map(|index| sequence.estimated_pose(index)).collect();
        assert_eq!(known_before, said);
        let end = sequence.corrected_poses(149);
        assert_eq!(end[..=120], known_after);
        assert!((120..150).all(|index| end[index] == sequence.estimated_pose(index)));
    }
    // A random walk's mean square over the time T is T / 2; with both ends held it is T / 6.
    let ratio = (after / before).sqrt();
    assert!((0.4..0.75).contains(&ratio), "{ratio} of the error remains");
}

#[test]
fn a_loop_closes_at_the_first_frame_from_its_time_on_or_never() {
    assert_eq!(drifting(1, Some(0.0)).loop_closure_frame(), Some(0));
    assert_eq!(drifting(1, Some(0.05)).loop_closure_frame(), Some(1));
    assert_eq!(drifting(1, Some(14.95)).loop_closure_frame(), None);
    let drift = drifting(1, None).corrected_poses(149);
    assert!(drifting(1, Some(14.95)).corrected_poses(149) == drift);
    // At the first frame there is nothing to correct yet.
    let corrected = drifting(1, Some(0.0)).corrected_poses(149);
    assert!(corrected.iter().zip(&drift).all(|(a, b)| a.distance(b) < 1e-12 && a.angle(b) < 1e-7));
}

#[test]
fn refuses_rates_that_are_none_by_name() {
    let field = |change: fn(&mut PoseErrorConfig)| {
        let mut config = small_config();
        change(&mut config.pose_error);
        match Sequence::new(&config).unwrap_err() {
            Error::Config(error) => error.field,
            other => panic!("{other}"),
        }
    };
    assert_eq!(field(|c| c.translation_per_second = -0.1), "pose_error.translation_per_second");
    assert_eq!(field(|c| c.rotation_per_second = f64::NAN), "pose_error.rotation_per_second");
    assert_eq!(field(|c| c.translation_per_metre = f64::INFINITY), "pose_error.translation_per_metre");
    assert_eq!(field(|c| c.rotation_per_radian = 2.0), "pose_error.rotation_per_radian");
    assert_eq!(field(|c| c.smoothness = 0.0), "pose_error.smoothness");
    assert_eq!(field(|c| c.translation_jitter = 2.0), "pose_error.translation_jitter");
    assert_eq!(field(|c| c.rotation_jitter = -1.0), "pose_error.rotation_jitter");
    assert_eq!(field(|c| c.loop_closure = Some(f64::NAN)), "pose_error.loop_closure");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Poses are the same bits in any order of the calls, from any copy of the sequence.
    #[test]
    fn a_pose_depends_on_config_and_index_alone(
        seed in 0_u64..1000,
        closure in proptest::option::of(0.0..16.0_f64),
        indices in proptest::collection::vec(0_usize..150, 1..20),
    ) {
        let sequence = drifting(seed, closure);
        let again = drifting(seed, closure);
        let forwards: Vec<Pose> = indices.iter().map(|&index| sequence.estimated_pose(index)).collect();
        let backwards: Vec<Pose> = indices.iter().rev().map(|&index| again.estimated_pose(index)).collect();
        prop_assert!(forwards.iter().eq(backwards.iter().rev()));
        for &index in &indices {
            let known = again.corrected_poses(index);
            prop_assert_eq!(known.len(), index + 1);
            prop_assert_eq!(known[index], sequence.estimated_pose(index));
        }
    }

    /// A longer sequence begins as a shorter one, and a smaller rate drifts less in the same direction.
    #[test]
    fn drift_scales_with_its_rate(seed in 0_u64..1000, factor in 0.1..0.9_f64) {
        let with = |rate: f64, frames: usize| {
            let mut config = small_config();
            config.seed = seed;
            config.frames = frames;
            config.path = CameraPath::Static;
            config.pose_error.translation_per_second = rate;
            Sequence::new(&config).unwrap()
        };
        let (full, part) = (with(0.02, 150), with(0.02 * factor, 80));
        let exact = full.world_from_camera(0);
        for index in [10, 40, 79] {
            let [full, part] = [&full, &part].map(|sequence| {
                let there = sequence.estimated_pose(index).translation();
                [0, 1, 2].map(|axis| there[axis] - exact.translation()[axis])
            });
            for axis in 0..3 {
                prop_assert!((factor * full[axis] - part[axis]).abs() < 1e-9);
            }
        }
    }
}

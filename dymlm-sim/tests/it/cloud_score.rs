//! Scores of maps with known errors.
use std::sync::LazyLock;

use dymlm_core::{PinholeCamera, Point, PointCloud, Pose};
use dymlm_metrics::{CloudScore, SpaceTruth, score_cloud};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame, Truth, TruthConfig};

struct Recorded {
    frames: Vec<SimulatedFrame>,
    truth: Truth,
    /// The static surface without noise.
    exact: Vec<Point>,
}

/// Twelve small frames in a world that is tilted on purpose.
static RECORDED: LazyLock<Recorded> = LazyLock::new(|| {
    let mut config = SequenceConfig::default();
    config.frames = 12;
    config.frame_rate = 2.0;
    config.camera = Some(PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap());
    config.world_from_scene = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let sequence = Sequence::new(&config).unwrap();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let frames: Vec<SimulatedFrame> = sequence.frames().collect();
    for frame in &frames {
        truth.observe(frame);
    }
    let exact = frames.iter().flat_map(|frame| points(frame, false)).collect();
    Recorded { frames, truth, exact }
});

/// The exact points of a frame within 0.5 to 4 m, either of movers or of everything else.
fn points(frame: &SimulatedFrame, movers: bool) -> Vec<Point> {
    let camera = frame.frame.camera();
    let depth = &frame.true_depth;
    (0..camera.width() * camera.height())
        .map(|pixel| (pixel % camera.width(), pixel / camera.width()))
        .filter(|&(u, v)| frame.mover_mask.at(u, v) == movers && (0.5..4.0).contains(&depth.at(u, v)))
        .map(|(u, v)| {
            let point = camera.back_project([u as f64, v as f64], depth.at(u, v).into());
            frame.world_from_camera.transform_point(point).map(|c| c as f32)
        })
        .collect()
}

fn score(points: Vec<Point>) -> CloudScore {
    score_cloud(&PointCloud::new(points), &RECORDED.truth).unwrap()
}

#[test]
fn the_exact_map_is_faultless() {
    let score = score(RECORDED.exact.clone());
    assert_eq!((score.residue, score.stray, score.completeness), (0.0, 0.0, 1.0));
    assert!(score.p95_distance < 1e-4, "{score:?}");
    assert!(score.points > 100_000 && score.visible_points > 5000, "{score:?}");
}

#[test]
fn a_shifted_map_is_inaccurate_by_the_shift() {
    // The map is shifted by 3 cm along the scene's z: floor and desk are off by the whole shift, walls not at
    // all.
    let up = Pose::new([0.0; 3], [0.5, -0.5, 0.5, 0.5]).unwrap().rotate([0.0, 0.0, 0.03]);
    let shifted =
        RECORDED.exact.iter().map(|p| std::array::from_fn(|axis| p[axis] + up[axis] as f32)).collect();
    let score = score(shifted);
    assert!((0.025..=0.0301).contains(&score.p95_distance), "{score:?}");
    assert_eq!((score.residue, score.stray), (0.0, 0.0));
    assert!(score.completeness > 0.99);
}

#[test]
fn a_ghost_is_residue_and_nothing_else() {
    let ghost: Vec<Point> = RECORDED.frames.iter().flat_map(|frame| points(frame, true)).collect();
    let far = ghost.iter().filter(|&&point| RECORDED.truth.surface_distance(point) > 0.06).count();
    assert!(far > 1000, "only {far} points of people");
    let mut map = RECORDED.exact.clone();
    map.extend(&ghost);
    let expected = far as f64 / map.len() as f64;
    let score = score(map);
    assert!((score.residue - expected).abs() < 1e-12 && score.stray == 0.0, "{score:?}, not {expected}");
}

#[test]
fn points_in_the_air_are_stray() {
    // Points at one place in the air behind the desk, off everybody's way.
    let world_from_scene = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let air = world_from_scene.transform_point([0.0, 1.95, 1.6]).map(|c| c as f32);
    assert!(RECORDED.truth.surface_distance(air) > 0.1);
    let mut map = RECORDED.exact.clone();
    let added = map.len() / 99;
    map.extend(std::iter::repeat_n(air, added));
    let score = score(map.clone());
    assert!(
        (score.stray - added as f64 / map.len() as f64).abs() < 1e-12 && score.residue == 0.0,
        "{score:?}"
    );
}

#[test]
fn a_map_without_half_of_the_room_is_incomplete() {
    let scene_from_world = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap().inverse();
    let left = |p: &Point| scene_from_world.transform_point(p.map(f64::from))[0] < 0.0;
    let visible = RECORDED.truth.visible_points();
    let kept = visible.iter().filter(|p| left(p)).count() as f64 / visible.len() as f64;
    let score = score(RECORDED.exact.iter().copied().filter(left).collect());
    // Within 5 cm of the cut, the missing half is still covered.
    assert!(score.completeness >= kept && score.completeness < kept + 0.05, "{score:?}, kept {kept}");
}

#[test]
fn points_that_are_none_do_not_count() {
    let truth = &RECORDED.truth;
    assert_eq!(score_cloud(&PointCloud::default(), truth), None);
    assert_eq!(score_cloud(&PointCloud::new(vec![[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0]]), truth), None);
    let mut map = RECORDED.exact.clone();
    let clean = score(map.clone());
    map.extend([[f32::NAN, 0.0, 0.0], [0.0, f32::NEG_INFINITY, f32::INFINITY]]);
    assert_eq!(score(map), clean);
    let huge = score(vec![[f32::MAX; 3], [-1e30, 0.0, 0.0]]);
    assert_eq!((huge.stray, huge.completeness), (1.0, 0.0));
}

#[test]
fn one_point_repeated_is_a_map_too() {
    let map = vec![RECORDED.exact[0]; 5000];
    let score = score(map);
    assert!(score.completeness < 0.01 && score.p95_distance < 1e-4);
}

#[test]
fn truth_refuses_what_is_no_config() {
    let sequence = Sequence::new(&SequenceConfig::default()).unwrap();
    let mut config = TruthConfig::default();
    config.max_depth = 0.2;
    assert_eq!(Truth::new(&sequence, &config).unwrap_err().field, "truth.min_depth");
    config = TruthConfig::default();
    config.max_incidence_deg = f64::NAN;
    assert_eq!(Truth::new(&sequence, &config).unwrap_err().field, "truth.max_incidence_deg");
}

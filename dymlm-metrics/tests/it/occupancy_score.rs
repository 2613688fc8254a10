//! `OccupancyScorer`: what its shares are shares of. Against exact truth it is tested in dymlm-sim.

use dymlm_core::{DepthImage, Frame, Mask, PinholeCamera, Point, Pose};
use dymlm_metrics::{FreeSpaceScore, Occupancy, OccupancyScorer, PointTruth};

/// The score of a map of free space before a wall at `depth` metres through which `movers` (balls of 0.3 m)
/// went: the map is occupied at `share` of the points that they swept.
fn score(depth: f32, movers: &[Point], share: f64) -> FreeSpaceScore {
    let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5).unwrap();
    let wall = DepthImage::new(64, 48, vec![depth; 64 * 48]).unwrap();
    let frame = Frame::new(0.0, camera, wall.clone(), None).unwrap();
    let mut scorer = OccupancyScorer::new(0.5..=4.0);
    for _ in 0..3 {
        scorer.observe(&frame, &wall, &Mask::filled(64, 48, false).unwrap(), &Pose::identity()).unwrap();
    }
    let pixels = (0..64 * 48).map(|i| [f64::from(i % 64), f64::from(i / 64)]);
    let surface = pixels.map(|pixel| camera.back_project(pixel, depth.into()).map(|c| c as f32)).collect();
    let truth = PointTruth::new(surface, movers, 0.3).unwrap();
    let mut asked = 0.0;
    let at = |point: Point| {
        let swept = movers.iter().any(|mover| {
            let square: f32 = mover.iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum();
            square <= 0.3 * 0.3
        });
        asked += f64::from(u8::from(swept));
        let is_ghost = swept && (asked * share).floor() > ((asked - 1.0) * share).floor();
        if is_ghost { Occupancy::Occupied } else { Occupancy::Free }
    };
    scorer.score(&truth, 0.05, &[], at).unwrap().free_space.unwrap()
}

#[test]
fn ghosts_are_a_share_of_what_movers_swept_however_large_the_room_is() {
    for depth in [1.6, 3.9] {
        let score = score(depth, &[[0.0, 0.0, 1.0]], 0.25);
        assert!((50..score.points / 2).contains(&score.swept_points), "{score:?}");
        let ghosts = (score.swept_points / 4) as f64;
        assert_eq!(score.ghosts, Some(ghosts / score.swept_points as f64), "{score:?}");
        assert_eq!((score.false_occupied, score.stray), (ghosts / score.points as f64, 0.0));
    }
}

#[test]
fn where_nobody_was_no_share_of_ghosts_is_known() {
    let score = score(3.0, &[], 0.0);
    assert_eq!((score.ghosts, score.swept_points, score.false_occupied), (None, 0, 0.0));
}

//! Tests of another day in the same rooms.

use dymlm_core::PinholeCamera;
use dymlm_geometry::OrientedBox;
use dymlm_sim::{PoseErrorConfig, Sequence, SequenceConfig};

fn building(day: u64) -> Sequence {
    let mut config = SequenceConfig::building(4, 3);
    config.camera = PinholeCamera::new(80, 60, 65.6, 65.6, 39.5, 29.5).ok();
    config.day = day;
    Sequence::new(&config).unwrap()
}

#[test]
fn on_another_day_some_things_stand_elsewhere() {
    let [first, second, again] = [0, 1, 1].map(building);
    let changes = second.differences_from(&first);
    let count = |before: bool, after: bool| {
        changes.iter().filter(|it| (it.before.is_some(), it.after.is_some()) == (before, after)).count()
    };
    // Things were moved, and some were removed or added.
    assert!(count(true, true) >= 1 && count(true, false) + count(false, true) >= 1, "{changes:?}");
    assert_eq!(changes, again.differences_from(&first));
    assert!(second.differences_from(&second).is_empty());
    for change in &changes {
        if let [Some(before), Some(after)] = [&change.before, &change.after] {
            let [from, to] = [before, after].map(OrientedBox::center);
            assert!((0..2).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt() > 0.9);
            assert!((from[2] - to[2]).abs() < 0.01, "{change:?}");
        }
    }
    // The camera goes the same way.
    assert_eq!(second.world_from_camera(700), first.world_from_camera(700));
    assert_ne!(second.frame(9).unwrap().frame.depth(), first.frame(9).unwrap().frame.depth());
}

#[test]
fn on_another_day_the_poses_drift_otherwise() {
    let drifting = |day: u64, seed: u64| {
        let mut config = SequenceConfig::default();
        config.frames = 20;
        (config.day, config.seed) = (day, seed);
        config.pose_error = PoseErrorConfig::slam();
        Sequence::new(&config).unwrap()
    };
    let [first, again, second, third] =
        [(0, 7), (0, 7), (1, 7), (2, 7)].map(|(day, seed)| drifting(day, seed));
    let last = first.len() - 1;
    assert_ne!(first.estimated_pose(last), first.world_from_camera(last));
    assert_eq!(first.estimated_pose(last), again.estimated_pose(last));
    assert_eq!(first.world_from_camera(last), second.world_from_camera(last));
    assert_ne!(first.estimated_pose(last), second.estimated_pose(last));
    assert_ne!(second.estimated_pose(last), third.estimated_pose(last));
}

//! Tests of another day in the same rooms.

use dymlm_core::PinholeCamera;
use dymlm_geometry::OrientedBox;
use dymlm_sim::{Sequence, SequenceConfig};

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

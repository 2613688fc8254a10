//! What a builder's memory consists of.

use crate::common::{config, insert_all, poses, sequence};
use dymlm::core::Pose;
use dymlm::{HistoryConfig, MapBuilder, MultiLevelMap};
use dymlm_sim::SimulatedFrame;

/// Bytes of each map that the other state of it does not share.
fn beside(map: &MultiLevelMap, other: &MultiLevelMap) -> [usize; 4] {
    [
        map.cloud().memory_bytes_beside(other.cloud()),
        map.octree().memory_bytes_beside(other.octree()),
        map.planes().memory_bytes_beside(other.planes()),
        map.objects().memory_bytes_beside(other.objects()),
    ]
}

#[test]
fn an_earlier_state_takes_the_memory_of_what_has_changed_since() {
    let frames: Vec<SimulatedFrame> = sequence(90).frames().step_by(10).collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    insert_all(&mut builder, &frames[..8]);
    builder.map().cloud().len();
    let earlier = builder.map().clone();
    let memory = earlier.memory();
    let whole = [memory.cloud, memory.octree, memory.planes, memory.objects];
    let untouched = beside(&earlier, builder.map());
    insert_all(&mut builder, &frames[8..]);
    builder.map().cloud().len();
    let changed = beside(&earlier, builder.map());
    for map in 0..4 {
        assert!(4 * untouched[map] < whole[map], "map {map}: {untouched:?} of {whole:?}");
        assert!(untouched[map] < changed[map], "map {map}: {untouched:?}, then {changed:?}");
        assert!(changed[map] <= whole[map], "map {map}: {changed:?} of {whole:?}");
    }
}

#[test]
fn what_is_kept_for_corrections_and_readers_is_counted() {
    let frames: Vec<SimulatedFrame> = sequence(120).frames().step_by(4).collect();
    let mut config = config();
    config.history = HistoryConfig::Folder(std::env::temp_dir());
    config.publish_interval = 60.0;
    let mut builder = MapBuilder::new(config).unwrap();
    insert_all(&mut builder, &frames[..20]);
    let memory = builder.memory();
    assert!(memory.history > 20 * size_of::<Pose>(), "{memory:?}");
    assert_eq!((memory.snapshots, memory.published), (0, 0));

    let reader = builder.reader();
    let moved = Pose::new([0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let last: Vec<_> = poses(&builder).into_iter().skip(15).map(|(id, pose)| (id, moved * pose)).collect();
    builder.correct_poses(&last).unwrap();
    insert_all(&mut builder, &frames[20..]);
    let memory = builder.memory();
    assert!(memory.published > memory.cloud / 10, "{memory:?}");
    assert!(memory.snapshots > memory.cloud / 10, "{memory:?}");
    assert!(memory.total() > memory.cloud + memory.snapshots + memory.published);
    drop(reader);
}

//! Maps within a budget of memory are the maps without one.
use crate::common::{fingerprint, poses};
use dymlm::core::{PinholeCamera, Pose};
use dymlm::{Error, HistoryConfig, MapBuilder, MapConfig, Selection};
#[cfg(feature = "io")]
use dymlm::{
    MultiLevelMap,
    core::PointCloud,
    files::{LoadOptions, MapSaver},
};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

/// A walk through four rooms.
fn frames() -> Vec<SimulatedFrame> {
    let mut config = SequenceConfig::building(4, 4);
    config.camera = PinholeCamera::new(80, 60, 65.6, 65.6, 39.5, 29.5).ok();
    let step = config.frames / 160;
    Sequence::new(&config).unwrap().frames().step_by(step).collect()
}

fn builder(budget: Option<usize>) -> MapBuilder {
    let mut config = MapConfig::offline();
    config.cloud.voxel_size = 0.05;
    config.history = HistoryConfig::Memory;
    config.memory.budget = budget;
    MapBuilder::new(config).unwrap()
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn maps_within_a_budget_are_the_maps_without_one() {
    let (paged, whole) = (&mut builder(Some(0)), &mut builder(None));
    let mut readers = [paged.reader(), whole.reader()];
    for frame in frames() {
        for builder in [&mut *paged, &mut *whole] {
            builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        }
    }
    // What the last frames have seen is most of so small a map.
    let memory = [paged.memory().cloud, whole.memory().cloud];
    assert!(10 * memory[0] < 9 * memory[1], "{memory:?}");
    assert!(paged.memory().planes < whole.memory().planes);
    assert!(fingerprint(paged.map()) == fingerprint(whole.map()));
    let clouds = readers.each_mut().map(|reader| reader.latest().cloud().point_cloud(Selection::Static));
    assert!(clouds[0] == clouds[1]);

    // The first time everything is mapped again, and earlier states are kept; the second time they are used.
    let last = poses(whole).len() - 12;
    for first in [last, last + 4] {
        let moved = Pose::new([0.1, 0.02, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let moved: Vec<_> = poses(whole)[first..].iter().map(|&(id, pose)| (id, moved * pose)).collect();
        for builder in [&mut *paged, &mut *whole] {
            builder.correct_poses(&moved).unwrap();
        }
        assert!(fingerprint(paged.map()) == fingerprint(whole.map()), "corrected from {first}");
    }
}

/// What is seen of maps with a budget that are saved, loaded, continued by a frame and saved again.
#[cfg(feature = "io")]
struct Reloaded {
    /// Bytes of the cloud when it has been loaded, and when its static points have been read.
    memory: [usize; 2],
    cloud: PointCloud,
    continued: Vec<u8>,
}

#[cfg(feature = "io")]
fn reloaded(frames: &[SimulatedFrame], budget: usize) -> Reloaded {
    let mut builder = builder(Some(budget));
    let insert = |builder: &mut MapBuilder, frame: &SimulatedFrame| {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    };
    frames.iter().step_by(2).for_each(|frame| insert(&mut builder, frame));
    let folder = tempfile::tempdir().unwrap();
    builder.map().save(folder.path()).unwrap();

    let (mut saver, map) = MapSaver::load(folder.path(), &LoadOptions::default()).unwrap();
    let loaded = map.memory().cloud;
    let cloud = map.cloud().point_cloud(Selection::Static);
    let memory = [loaded, map.memory().cloud];
    let mut builder = MapBuilder::resume(map).unwrap();
    insert(&mut builder, &frames[0]);
    let continued = fingerprint(builder.map());
    saver.save(builder.map()).unwrap();
    assert!(fingerprint(&MultiLevelMap::load(folder.path()).unwrap()) == continued);
    Reloaded { memory, cloud, continued }
}

#[cfg(feature = "io")]
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn maps_are_loaded_within_their_budget() {
    let frames = frames();
    let [small, large] = [0, usize::MAX].map(|budget| reloaded(&frames, budget));
    assert!(small.cloud == large.cloud && small.continued == large.continued);
    let [small, large] = [small.memory, large.memory];
    assert!(3 * small[0] < large[0], "{small:?} {large:?}");
    assert!(
        2 * small[1] < large[1],
        "reading the static points leaves blocks in the file: {small:?} {large:?}"
    );
}

/// Regression: while maps were made anew, what their history held in memory did not count.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn merged_maps_are_within_the_budget_with_their_history() {
    let frames = frames();
    let (first, second) = frames.split_at(frames.len() / 2);
    let map = |frames: &[SimulatedFrame], budget: Option<usize>| {
        let mut builder = builder(budget);
        for frame in frames.iter().step_by(2) {
            builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        }
        builder.into_map()
    };
    let merged = |budget: Option<usize>| {
        let mut merged = map(first, budget);
        merged.merge(&map(second, budget), &Pose::identity()).unwrap();
        merged
    };
    let whole = merged(None);
    let memory = whole.memory();
    let paged = merged(Some(memory.total() - memory.cloud));
    assert!(10 * paged.memory().cloud < 9 * memory.cloud, "{:?} {memory:?}", paged.memory());
    assert!(fingerprint(&paged) == fingerprint(&whole));
}

#[test]
fn a_folder_that_is_not_there_is_named_before_anything_is_mapped() {
    let mut config = MapConfig::default();
    config.memory.budget = Some(100_000_000);
    config.memory.path = Some("/nowhere/at/all".into());
    let refused = MapBuilder::new(config).unwrap_err();
    assert!(
        matches!(refused, Error::Paging(_)) && refused.to_string().contains("/nowhere/at/all"),
        "{refused}"
    );
}

//! Maps within a budget of memory are the maps without one.
use crate::common::{fingerprint, poses};
use dymlm::core::{PinholeCamera, Pose};
use dymlm::{Error, HistoryConfig, MapBuilder, MapConfig, Selection};
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

/// Maps that were saved are loaded within their budget, and are the same; what has been paged out is saved again.
#[cfg(feature = "io")]
#[test]
fn maps_are_loaded_within_their_budget() {
    let parent = tempfile::tempdir().unwrap();
    let [small, large] = [Some(0), Some(usize::MAX)].map(|budget| {
        let mut builder = builder(budget);
        for frame in frames().iter().step_by(2) {
            builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        }
        let folder = parent.path().join(format!("{budget:?}"));
        builder.map().save(&folder).unwrap();
        dymlm::files::MapSaver::load(&folder, None).unwrap()
    });
    let memory = [&small.1, &large.1].map(|map| map.memory().cloud);
    assert!(3 * memory[0] < memory[1], "{memory:?}");

    let maps = [small, large].map(|(mut saver, map)| {
        let frame = &frames()[0];
        let cloud = map.cloud().point_cloud(Selection::Static);
        let after_reading = map.memory().cloud;
        let mut builder = MapBuilder::resume(map).unwrap();
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        saver.save(builder.map()).unwrap();
        let again = dymlm::MultiLevelMap::load(saver.folder()).unwrap();
        assert!(fingerprint(&again) == fingerprint(builder.map()));
        (cloud, fingerprint(builder.map()), after_reading)
    });
    assert!(maps[0].0 == maps[1].0 && maps[0].1 == maps[1].1);
    assert!(2 * maps[0].2 < maps[1].2, "reading the static cloud leaves blocks in the file");
}

#[test]
fn a_folder_that_is_not_there_is_named_before_anything_is_mapped() {
    let mut config = MapConfig::default();
    config.memory.budget = Some(100_000_000);
    config.memory.path = Some("/nowhere/at/all".into());
    assert!(matches!(MapBuilder::new(config), Err(Error::Paging { .. })));
}

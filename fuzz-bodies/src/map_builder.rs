use dymlm::{HistoryConfig, MapConfig, MultiLevelMap};

use crate::calls::Calls;
use crate::choices::Choices;
use crate::fingerprint::fingerprint;
use crate::memory_folder::memory_folder;

/// Calls of a map builder, in any order and with any arguments: small frames, detections, late detections,
/// corrections, scans, readers' queries, maps that are saved, loaded, resumed and merged. With a memory
/// budget, the maps must be the same as without.
pub fn map_builder(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let folder = memory_folder();
    let mut config = MapConfig::default();
    config.history = match choices.below(4) {
        0 => HistoryConfig::None,
        1 => HistoryConfig::Folder(folder.path().to_owned()),
        _ => HistoryConfig::Memory,
    };
    config.sensor.stride = 1 + usize::from(choices.below(2));
    // Fine cells are rare: most errors do not depend on the number of cells.
    let fineness = choices.byte();
    config.cloud.voxel_size = if fineness < 16 { 0.01 } else { 0.1 };
    config.octree.resolution = if fineness < 16 { 0.05 } else { [0.2, 0.5, 1.0][usize::from(fineness % 3)] };
    config.max_detection_delay = f64::from(choices.below(3)) * 0.2;

    let budget = (choices.byte() < 64).then(|| 1 << (10 + choices.below(8)));

    let unlimited = built(config.clone(), choices.clone());
    if budget.is_some() {
        (config.memory.budget, config.memory.path) = (budget, Some(folder.path().to_owned()));
        let limited = built(config, choices);
        assert!(fingerprint(&limited) == fingerprint(&unlimited), "other maps with a budget of memory");
    }
}

fn built(config: MapConfig, mut choices: Choices<'_>) -> MultiLevelMap {
    let mut calls = Calls::new(config, 0.0);
    calls.run(24, &mut choices);
    calls.builder.settle();
    let counts = calls.builder.map().counts();
    let map = calls.builder.into_map();
    assert_eq!(map.counts(), counts);
    map
}

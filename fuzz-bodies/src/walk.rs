use std::collections::BTreeMap;
use std::sync::LazyLock;

use dymlm::octree::RayMode;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap};
use dymlm_core::PinholeCamera;
use dymlm_io::MapFolder;
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

use crate::memory_folder::memory_folder;

/// Number of frames in the map; further frames follow.
pub(crate) const MAPPED: usize = 6;
const FRAMES: usize = 10;

/// A walk in small images, with people, furniture, planes and objects.
pub(crate) static WALK: LazyLock<Vec<SimulatedFrame>> = LazyLock::new(|| {
    let mut config = SequenceConfig::default();
    config.frames = 5 * FRAMES;
    config.camera = PinholeCamera::new(48, 36, 39.4, 39.4, 23.5, 17.5).ok();
    Sequence::new(&config).unwrap().frames().step_by(5).collect()
});

/// The maps of the walk's first frames, with large cells.
pub(crate) static MAP: LazyLock<MultiLevelMap> = LazyLock::new(|| {
    let mut config = MapConfig::default();
    config.history = HistoryConfig::Memory;
    config.cloud.voxel_size = 0.1;
    config.octree.resolution = 0.4;
    config.octree.rays = RayMode::PerCell;
    let mut builder = MapBuilder::new(config).unwrap();
    for frame in &WALK[..MAPPED] {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
    builder.settle();
    builder.into_map()
});

/// The sections of a saved state.
pub(crate) const SECTIONS: [&str; 8] =
    ["cloud", "octree", "planes", "objects", "history", "frames", "events", "head"];

/// The parts of a section, by key.
pub(crate) type Parts = Vec<(u64, Vec<u8>)>;

/// The parts of [`MAP`] on disk, without checksums.
pub(crate) static SAVED: LazyLock<BTreeMap<&str, Parts>> = LazyLock::new(|| {
    let folder = memory_folder();
    MAP.save(folder.path().join("map")).unwrap();
    let map = MapFolder::open(folder.path().join("map")).unwrap();
    let parts = |section| map.state(section).unwrap().collect::<Result<Parts, _>>().unwrap();
    SECTIONS.into_iter().map(|section| (section, parts(section))).collect()
});

/// The files of [`MAP`] that are read when it is loaded.
pub(crate) const SAVED_FILES: [&str; 3] = ["manifest.json", "state.index", "state-000001.bin"];

/// The contents of these files, by their indices.
pub(crate) static SAVED_FOLDER: LazyLock<Parts> = LazyLock::new(|| {
    let folder = memory_folder();
    MAP.save(folder.path().join("map")).unwrap();
    let read = |name| std::fs::read(folder.path().join("map").join(name)).unwrap();
    (0..).zip(SAVED_FILES.map(read)).collect()
});

//! Maps that outlive the process: what is saved is loaded, what is damaged is named, and who else writes is
//! told.
#![cfg(feature = "io")]
use std::fs;
use std::path::Path;
use std::time::Duration;

use crate::common::{fingerprint, fingerprint_without_ids, poses};
use dymlm::files::{Autosave, LoadOptions, MapSaver};
use dymlm::{
    Detections, Error, HistoryConfig, MapBuilder, MapConfig, MapCounts, MemoryConfig, MultiLevelMap,
};
use dymlm_core::{FrameId, PinholeCamera, Pose};
use dymlm_io::MapFolder;
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

fn config(history: HistoryConfig) -> MapConfig {
    let mut config = MapConfig::offline();
    config.cloud.voxel_size = 0.03;
    config.history = history;
    config
}

fn simulated(frames: std::ops::Range<usize>) -> Vec<SimulatedFrame> {
    let mut config = SequenceConfig::default();
    config.frames = 40;
    config.camera = PinholeCamera::new(80, 60, 65.0, 65.0, 39.5, 29.5).ok();
    let sequence = Sequence::new(&config).unwrap();
    sequence.frames().step_by(4).take(frames.end).skip(frames.start).collect()
}

fn insert(builder: &mut MapBuilder, frames: std::ops::Range<usize>) {
    for simulated in simulated(frames) {
        builder.insert(&simulated.frame, &simulated.detections, &simulated.world_from_camera).unwrap();
    }
}

fn mapped(history: HistoryConfig) -> MapBuilder {
    let mut builder = MapBuilder::new(config(history)).unwrap();
    insert(&mut builder, 0..6);
    builder
}

/// Observations are kept there from now on.
fn keeping(history: HistoryConfig) -> LoadOptions {
    let mut options = LoadOptions::default();
    options.history = Some(history);
    options
}

/// Whether something becomes so within ten seconds.
fn is_so_soon(is_so: impl Fn() -> bool) -> bool {
    (0..2000).inspect(|_| std::thread::sleep(Duration::from_millis(5))).any(|_| is_so())
}

/// Whether a folder soon has a builder's maps, which somebody saves at intervals.
fn is_saved_soon(folder: &Path, builder: &MapBuilder) -> bool {
    let revision = builder.map().revision();
    is_so_soon(|| MultiLevelMap::load(folder).is_ok_and(|map| map.revision() == revision))
}

/// Changes a byte of a file; of a state's segment one within a part of a section.
fn damage(path: &Path, at: usize) {
    let mut bytes = fs::read(path).unwrap();
    bytes[at] ^= 0x10;
    fs::write(path, bytes).unwrap();
}

/// Bytes of the files without a name in a folder that this process holds.
#[cfg(target_os = "linux")]
fn nameless_bytes(folder: &Path) -> u64 {
    let held = fs::read_dir("/proc/self/fd").unwrap().flatten().map(|entry| entry.path());
    let own = held.filter(|file| fs::read_link(file).is_ok_and(|target| target.starts_with(folder)));
    own.filter_map(|file| fs::metadata(file).ok()).map(|file| file.len()).sum()
}

/// What both hold was copied from the other map each time.
#[cfg(target_os = "linux")]
#[test]
fn a_map_that_is_merged_again_and_again_takes_what_is_new_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let saved = |name: &str, frames: usize| {
        let mut builder = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
        insert(&mut builder, 0..frames);
        builder.map().save(at(name)).unwrap();
    };
    saved("short", 4);
    saved("long", 7);
    let loaded = |name: &str, history: &str| {
        fs::create_dir(at(history)).unwrap();
        MultiLevelMap::load_with(at(name), &keeping(HistoryConfig::Folder(at(history)))).unwrap()
    };
    let (mut own, same, longer) = (loaded("short", "own"), loaded("short", "same"), loaded("long", "longer"));
    let bytes = || nameless_bytes(&at("own"));
    let first = bytes();
    own.merge(&same, &Pose::identity()).unwrap();
    assert!(first > 0 && bytes() == first, "{first} bytes, then {}", bytes());
    own.merge(&longer, &Pose::identity()).unwrap();
    let all = bytes();
    assert!(all > first && all < nameless_bytes(&at("longer")) * 11 / 10, "{all}");
    own.merge(&longer, &Pose::identity()).unwrap();
    assert_eq!(bytes(), all);
}

#[test]
fn what_is_saved_is_loaded_with_the_config_and_the_history() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut builder = mapped(HistoryConfig::Memory);
    builder.map().save(&folder).unwrap();
    let map = MultiLevelMap::load(&folder).unwrap();
    assert!(fingerprint(&map) == fingerprint(builder.map()));
    assert_eq!(map.config(), builder.config());
    assert_eq!(map.revision(), builder.map().revision());

    let mut loaded = MapBuilder::resume(map).unwrap();
    assert_eq!(poses(&loaded), poses(&builder));
    let moved = [(FrameId::new(2), Pose::new([0.3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap())];
    builder.correct_poses(&moved).unwrap();
    loaded.correct_poses(&moved).unwrap();
    assert!(fingerprint(loaded.map()) == fingerprint(builder.map()));
}

#[test]
fn the_history_can_be_kept_elsewhere() {
    let parent = tempfile::tempdir().unwrap();
    let [folder, old, new] = ["map", "old", "new"].map(|name| parent.path().join(name));
    fs::create_dir(&old).unwrap();
    fs::create_dir(&new).unwrap();
    mapped(HistoryConfig::Folder(old.clone())).map().save(&folder).unwrap();
    fs::remove_dir(&old).unwrap();
    assert!(matches!(MultiLevelMap::load(&folder), Err(Error::History(_))));
    let map = MultiLevelMap::load_with(&folder, &keeping(HistoryConfig::Folder(new))).unwrap();
    let mut builder = MapBuilder::resume(map).unwrap();
    assert_eq!(builder.remove(FrameId::new(0)).unwrap().key_frames, 5);

    mapped(HistoryConfig::None).map().save(&folder).unwrap();
    let map = MultiLevelMap::load_with(&folder, &keeping(HistoryConfig::Memory)).unwrap();
    assert!(matches!(MapBuilder::resume(map).unwrap().remove(FrameId::new(0)), Err(Error::NoHistory)));
}

/// Regression: the maps of a robot could not be continued where the folder of its budget is not.
#[test]
fn another_machine_has_a_memory_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let (robot, saved) = (folder.path().join("robot"), folder.path().join("map"));
    fs::create_dir(&robot).unwrap();
    let mut config = config(HistoryConfig::Memory);
    (config.memory.budget, config.memory.path) = (Some(0), Some(robot.clone()));
    let mut builder = MapBuilder::new(config).unwrap();
    insert(&mut builder, 0..6);
    builder.map().save(&saved).unwrap();
    let paged = MultiLevelMap::load(&saved).unwrap().memory().cloud;
    fs::remove_dir(&robot).unwrap();
    let resumed = MapBuilder::resume(MultiLevelMap::load(&saved).unwrap());
    assert!(matches!(resumed, Err(Error::Paging(_))));

    let mut options = LoadOptions::default();
    options.memory = Some(MemoryConfig::default());
    let (mut saver, map) = MapSaver::load(&saved, &options).unwrap();
    assert!(2 * paged < map.memory().cloud, "{paged} {:?}", map.memory());
    let mut resumed = MapBuilder::resume(map).unwrap();
    fs::create_dir(&robot).unwrap();
    let mut builder = MapBuilder::resume(builder.map().clone()).unwrap();
    insert(&mut resumed, 6..8);
    insert(&mut builder, 6..8);
    assert!(fingerprint(resumed.map()) == fingerprint(builder.map()));
    saver.save(resumed.map()).unwrap();
    assert_eq!(MultiLevelMap::load(&saved).unwrap().config().memory, MemoryConfig::default());
}

#[test]
fn of_a_damaged_folder_the_rest_is_read() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let builder = mapped(HistoryConfig::None);
    builder.map().save(&folder).unwrap();
    // The first section that is written is the cloud's.
    damage(&folder.join("state-000001.bin"), 10);
    let error = MultiLevelMap::load(&folder).unwrap_err();
    assert!(error.to_string().contains("of cloud, in"), "{error}");
    let (map, missing) = MultiLevelMap::load_partial(&folder).unwrap();
    assert_eq!(missing.iter().map(|missing| missing.section).collect::<Vec<_>>(), ["cloud"]);
    assert!(map.cloud().is_empty());
    assert_eq!(map.octree().counts(), builder.map().octree().counts());
    assert_eq!(
        (map.planes().len(), map.objects().len()),
        (builder.map().planes().len(), builder.map().objects().len())
    );

    damage(&folder.join("cloud.ply"), 500);
    assert!(matches!(MultiLevelMap::load(&folder), Err(Error::Files(dymlm_io::Error::Checksum { .. }))));
    assert_eq!(MultiLevelMap::load_partial(&folder).unwrap().1.len(), 1, "the standard files are not read");
    damage(&folder.join("state.index"), 5);
    assert!(MultiLevelMap::load_partial(&folder).is_err());
}

/// What a session has shown is in the history, whatever maps were lost.
#[test]
fn a_merge_maps_again_what_could_not_be_loaded() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut whole = mapped(HistoryConfig::Memory).into_map();
    whole.save(&folder).unwrap();
    damage(&folder.join("state-000001.bin"), 10);
    let (mut partial, missing) = MultiLevelMap::load_partial(&folder).unwrap();
    assert_eq!(missing.len(), 1);

    let mut later = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    insert(&mut later, 7..9);
    let later = later.into_map();
    for map in [&mut whole, &mut partial] {
        map.merge(&later, &Pose::identity()).unwrap();
    }
    assert!(fingerprint_without_ids(&partial) == fingerprint_without_ids(&whole));
}

#[test]
fn a_folder_that_is_replaced_while_it_is_read_is_read_again() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut builder = mapped(HistoryConfig::None);
    builder.map().save(&folder).unwrap();
    let mut readings = 0;
    let read = |read: &MapFolder| {
        readings += 1;
        if readings == 1 {
            insert(&mut builder, 6..8);
            builder.map().save(&folder).unwrap();
        }
        read.counts::<MapCounts>()
    };
    let counts = MapFolder::read_unreplaced(|| MapFolder::open(&folder), read).unwrap();
    assert_eq!((readings, counts), (2, builder.map().counts()));
}

#[test]
fn a_folder_of_another_version_or_without_a_state_is_refused() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let builder = mapped(HistoryConfig::None);
    let mut files = dymlm_io::MapFolderWriter::create(&folder).unwrap();
    builder.map().write_files(&mut files).unwrap();
    files.finish(builder.config(), &builder.map().counts()).unwrap();
    let error = MultiLevelMap::load(&folder).unwrap_err();
    assert!(matches!(error, Error::Files(dymlm_io::Error::Malformed { .. })), "{error}");

    builder.map().save(&folder).unwrap();
    let manifest = folder.join("manifest.json");
    // The version's number with a digit before it.
    let newer = fs::read_to_string(&manifest).unwrap().replace("\"version\": ", "\"version\": 1");
    fs::write(&manifest, newer).unwrap();
    assert!(matches!(
        MultiLevelMap::load(&folder),
        Err(Error::Files(dymlm_io::Error::MapVersion { found, supported, .. })) if found > supported
    ));
    assert!(MultiLevelMap::load(parent.path().join("nothing")).is_err());
}

#[test]
fn maps_are_saved_while_they_are_built() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut builder = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    let saver = MapSaver::create(&folder).unwrap();
    let autosave = Autosave::start(builder.reader(), saver, Duration::from_millis(20)).unwrap();
    assert!(matches!(MapSaver::create(&folder), Err(dymlm_io::Error::Locked { .. })));
    insert(&mut builder, 0..3);
    builder.settle();
    // The first save comes by itself.
    assert!(is_saved_soon(&folder, &builder));
    insert(&mut builder, 3..6);
    builder.settle();
    drop(autosave);
    let map = MultiLevelMap::load(&folder).unwrap();
    assert!(fingerprint(&map) == fingerprint(builder.map()));
}

/// Regression: who saves at intervals learned only at the end that the disk had been full for hours.
#[test]
fn a_save_that_fails_is_told_until_one_succeeds() {
    let parent = tempfile::tempdir().unwrap();
    let place = parent.path().join("place");
    fs::create_dir(&place).unwrap();
    let saver = MapSaver::create(place.join("map")).unwrap();
    let mut builder = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    let autosave = Autosave::start(builder.reader(), saver, Duration::from_millis(20)).unwrap();
    fs::remove_dir_all(&place).unwrap();
    insert(&mut builder, 0..3);
    builder.settle();
    let comes = |is_failing: bool| is_so_soon(|| autosave.failure().is_some() == is_failing);
    assert!(comes(true));
    assert!(matches!(autosave.failure().as_deref(), Some(dymlm_io::Error::Io { .. })));
    fs::create_dir(&place).unwrap();
    assert!(comes(false));
    autosave.finish().unwrap();
    assert!(fingerprint(&MultiLevelMap::load(place.join("map")).unwrap()) == fingerprint(builder.map()));
}

/// Regression: what was saved before was taken to be there still. Each save failed, or it kept files of
/// others.
#[test]
fn a_folder_that_somebody_has_removed_or_replaced_is_written_again() {
    let parent = tempfile::tempdir().unwrap();
    let [folder, other] = ["map", "other"].map(|name| parent.path().join(name));
    let mut short = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    insert(&mut short, 0..2);
    short.map().save(&other).unwrap();
    let mut builder = mapped(HistoryConfig::Memory);
    let mut saver = MapSaver::create(&folder).unwrap();
    for spoil in [
        |folder: &Path, _: &Path| fs::remove_dir_all(folder).unwrap(),
        |folder: &Path, other: &Path| {
            fs::remove_dir_all(folder).unwrap();
            fs::rename(other, folder).unwrap();
        },
    ] {
        saver.save(builder.map()).unwrap();
        spoil(&folder, &other);
        let next = builder.trajectory().count();
        insert(&mut builder, next..next + 1);
        builder.settle();
        saver.save(builder.map()).unwrap();
        assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(builder.map()));
    }
}

/// Regression: another builder's maps of a lower revision counted as saved.
#[test]
fn the_maps_of_another_builder_are_saved_at_the_end() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapSaver::create(&folder).unwrap();
    saver.save(mapped(HistoryConfig::Memory).map()).unwrap();
    let mut other = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    insert(&mut other, 0..2);
    Autosave::start(other.reader(), saver, Duration::from_secs(3600)).unwrap().finish().unwrap();
    assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(other.map()));
}

/// Regression: frames that no map had seen were not saved, and their ids were given again.
#[test]
fn frames_without_a_trace_in_the_maps_are_saved_as_well() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut config = config(HistoryConfig::Memory);
    (config.key_frames.max_interval, config.key_frames.min_translation) = (f64::INFINITY, f64::INFINITY);
    config.key_frames.min_rotation = f64::INFINITY;
    let mut builder = MapBuilder::new(config).unwrap();
    let saver = MapSaver::create(&folder).unwrap();
    let autosave = Autosave::start(builder.reader(), saver, Duration::from_millis(5)).unwrap();
    insert(&mut builder, 0..1);
    builder.settle();
    assert!(is_saved_soon(&folder, &builder));
    insert(&mut builder, 1..4);
    builder.settle();
    assert!(is_saved_soon(&folder, &builder));
    // What a correction of such frames alone has changed is lost otherwise.
    let (last, _, pose) = builder.trajectory().last().unwrap();
    let moved = Pose::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap() * pose;
    builder.correct_poses(&[(last, moved)]).unwrap();
    autosave.finish().unwrap();
    let resumed = MapBuilder::resume(MultiLevelMap::load(&folder).unwrap()).unwrap();
    assert_eq!(resumed.trajectory().count(), 4);
    assert!(resumed.trajectory().eq(builder.trajectory()) && builder.trajectory().last().unwrap().2 == moved);
}

#[test]
fn what_was_never_saved_is_saved_at_the_end() {
    let parent = tempfile::tempdir().unwrap();
    let start = |builder: &mut MapBuilder, saver| {
        Autosave::start(builder.reader(), saver, Duration::from_secs(3600)).unwrap()
    };
    let empty = parent.path().join("empty");
    let mut nothing = MapBuilder::new(config(HistoryConfig::None)).unwrap();
    start(&mut nothing, MapSaver::create(&empty).unwrap()).finish().unwrap();
    assert!(MultiLevelMap::load(&empty).unwrap().cloud().is_empty());

    // Maps that were there at the beginning, without `finish`.
    let folder = parent.path().join("map");
    let mut builder = mapped(HistoryConfig::None);
    drop(start(&mut builder, MapSaver::create(&folder).unwrap()));
    assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(builder.map()));
    // An empty map replaces none when its builder comes to nothing.
    drop(start(&mut nothing, MapSaver::create(&folder).unwrap()));
    assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(builder.map()));

    // Maps that went on after they were loaded, before the saving began.
    let (saver, map) = MapSaver::load(&folder, &LoadOptions::default()).unwrap();
    builder = MapBuilder::resume(map).unwrap();
    insert(&mut builder, 6..8);
    builder.settle();
    drop(start(&mut builder, saver));
    assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(builder.map()));
}

/// Regression: maps that were resumed and came to nothing replaced those of another folder.
#[test]
fn loaded_maps_to_which_nothing_was_added_are_saved_at_the_end_alone() {
    let parent = tempfile::tempdir().unwrap();
    let [from, to] = ["from", "to"].map(|name| parent.path().join(name));
    mapped(HistoryConfig::None).map().save(&from).unwrap();
    let mut other = MapBuilder::new(config(HistoryConfig::None)).unwrap();
    insert(&mut other, 0..2);
    other.map().save(&to).unwrap();
    let stands = || fingerprint(&MultiLevelMap::load(&to).unwrap());
    let start = |builder: &mut MapBuilder, interval| {
        Autosave::start(builder.reader(), MapSaver::create(&to).unwrap(), interval).unwrap()
    };

    let mut resumed = MapBuilder::resume(MultiLevelMap::load(&from).unwrap()).unwrap();
    let autosave = start(&mut resumed, Duration::from_millis(5));
    std::thread::sleep(Duration::from_millis(100));
    assert!(stands() == fingerprint(other.map()));
    drop(autosave);
    assert!(stands() == fingerprint(other.map()));

    start(&mut resumed, Duration::from_secs(3600)).finish().unwrap();
    assert!(stands() == fingerprint(resumed.map()));
    insert(&mut resumed, 6..8);
    resumed.settle();
    drop(start(&mut resumed, Duration::from_secs(3600)));
    assert!(stands() == fingerprint(resumed.map()));
}

/// JSON has no infinity.
#[test]
fn infinite_amounts_of_a_config_are_saved() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut config = config(HistoryConfig::None);
    let key_frames = &mut config.key_frames;
    (key_frames.min_translation, key_frames.min_rotation) = (f64::INFINITY, f64::INFINITY);
    key_frames.max_interval = f64::INFINITY;
    config.octree.max_range = f64::INFINITY;
    let builder = MapBuilder::new(config.clone()).unwrap();
    builder.map().save(&folder).unwrap();
    assert_eq!(MapFolder::open(&folder).unwrap().config::<MapConfig>().unwrap(), config);
    assert_eq!(*MultiLevelMap::load(&folder).unwrap().config(), config);
}

/// Bytes of the parts that the last save has written.
fn last_segment(folder: &Path) -> u64 {
    let segments = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let segments = segments.filter(|file| file.file_name().to_str().unwrap().starts_with("state-"));
    segments.max_by_key(fs::DirEntry::file_name).unwrap().metadata().unwrap().len()
}

#[test]
fn loaded_maps_are_saved_by_what_has_changed_since() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    mapped(HistoryConfig::Memory).map().save(&folder).unwrap();
    let first = last_segment(&folder);

    let (mut saver, map) = MapSaver::load(&folder, &LoadOptions::default()).unwrap();
    assert!(matches!(
        MapSaver::load(&folder, &LoadOptions::default()),
        Err(Error::Files(dymlm_io::Error::Locked { .. }))
    ));
    let mut builder = MapBuilder::resume(map).unwrap();
    saver.save(builder.map()).unwrap();
    let heads = last_segment(&folder);
    assert!(heads < first / 50, "{heads} bytes of {first}, where nothing has changed");
    insert(&mut builder, 6..8);
    builder.settle();
    saver.save(builder.map()).unwrap();
    let loaded = MultiLevelMap::load(&folder).unwrap();
    assert!(fingerprint(&loaded) == fingerprint(builder.map()));
    let goes_on = |map| {
        let mut builder = MapBuilder::resume(map).unwrap();
        insert(&mut builder, 8..10);
        fingerprint(builder.map())
    };
    assert!(goes_on(loaded) == goes_on(builder.into_map()));
    drop(saver);

    // A folder that holds no map has nothing to go on with.
    assert!(MapSaver::load(parent.path().join("nothing"), &LoadOptions::default()).is_err());
    damage(&folder.join("state.index"), 40);
    assert!(MapSaver::load(&folder, &LoadOptions::default()).is_err());
}

/// Bytes of the state of a saved map, without the standard files.
fn state_bytes(folder: &Path) -> u64 {
    let files = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let of_state = files.filter(|file| file.file_name().to_string_lossy().starts_with("state"));
    of_state.map(|file| file.metadata().unwrap().len()).sum()
}

#[test]
fn a_history_that_is_kept_no_longer_leaves_the_folder() {
    let parent = tempfile::tempdir().unwrap();
    let [folder, other] = ["map", "other"].map(|name| parent.path().join(name));
    let builder = mapped(HistoryConfig::Memory);
    builder.map().save(&folder).unwrap();
    let (mut saver, map) = MapSaver::load(&folder, &keeping(HistoryConfig::None)).unwrap();
    saver.save(&map).unwrap();
    map.save(&other).unwrap();
    assert_eq!(state_bytes(&folder), state_bytes(&other));
    assert!(fingerprint(&MultiLevelMap::load(&folder).unwrap()) == fingerprint(builder.map()));
}

#[test]
fn a_log_that_comes_and_goes_leaves_nothing_behind() {
    let parent = tempfile::tempdir().unwrap();
    let [folder, other] = ["map", "other"].map(|name| parent.path().join(name));
    mapped(HistoryConfig::Memory).map().save(&other).unwrap();
    let segment = other.join("state-000001.bin");
    let whole = fs::read(&segment).unwrap();
    // Where the history is in the file shows by what is missing when a byte of it is damaged.
    let without_log = (0..100).rev().find_map(|share| {
        fs::write(&segment, &whole).unwrap();
        damage(&segment, whole.len() * share / 100);
        let (map, missing) = MultiLevelMap::load_partial(&other).ok()?;
        (missing.len() == 1 && missing[0].section == "history").then_some(map)
    });
    let without_log = without_log.unwrap();
    let mut short = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    insert(&mut short, 0..2);

    let mut saver = MapSaver::create(&folder).unwrap();
    for map in [mapped(HistoryConfig::Memory).map(), &without_log, short.map()] {
        saver.save(map).unwrap();
    }
    let loaded = MultiLevelMap::load(&folder).unwrap();
    assert!(fingerprint(&loaded) == fingerprint(short.map()));
    assert_eq!(poses(&MapBuilder::resume(loaded).unwrap()), poses(&short));
}

#[test]
fn a_copy_from_before_the_first_key_frame_is_of_the_same_session() {
    let mut builder = MapBuilder::new(config(HistoryConfig::Memory)).unwrap();
    let first = &simulated(0..1)[0];
    builder.insert(&first.frame, Detections::Pending, &first.world_from_camera).unwrap();
    let copy = builder.map().clone();
    builder.process_waiting().unwrap();
    insert(&mut builder, 1..4);
    let mut map = builder.into_map();
    let (sessions, before) = (map.sessions(), fingerprint(&map));
    map.merge(&copy, &Pose::identity()).unwrap();
    assert_eq!(map.sessions(), sessions);
    assert!(fingerprint(&map) == before);
}

#[test]
fn settled_maps_stay_as_they_are() {
    let mut builder = mapped(HistoryConfig::Memory);
    builder.settle();
    let revision = builder.map().revision();
    builder.settle();
    assert_eq!(builder.map().revision(), revision);
}

#[cfg(target_os = "linux")]
#[test]
fn a_path_that_cannot_be_saved_is_refused_at_the_beginning() {
    use std::os::unix::ffi::OsStrExt;

    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join(std::ffi::OsStr::from_bytes(b"caf\xe9"));
    fs::create_dir(&folder).unwrap();
    let error = MapBuilder::new(config(HistoryConfig::Folder(folder.clone()))).unwrap_err();
    assert!(matches!(error, Error::PathNotUtf8 { field: "history.folder", .. }), "{error}");
    let mut paged = config(HistoryConfig::None);
    paged.memory.path = Some(folder);
    assert!(matches!(MapBuilder::new(paged), Err(Error::PathNotUtf8 { field: "memory.path", .. })));
}

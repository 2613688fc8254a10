//! Maps that other threads read while they are built.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::common::map_copy::MapCopy;
use crate::common::{config, fingerprint, insert_all, poses, sequence};
use dymlm::core::Pose;
use dymlm::{HistoryConfig, MapBuilder, MapReader, MultiLevelMap, Revision, Selection};
use dymlm_sim::SimulatedFrame;

fn frames(count: usize) -> Vec<SimulatedFrame> {
    sequence(3 * count).frames().step_by(3).collect()
}

/// Publishes each key frame.
fn builder() -> MapBuilder {
    let mut config = config();
    config.publish_interval = 0.0;
    config.history = HistoryConfig::Memory;
    MapBuilder::new(config).unwrap()
}

/// The maps of frames that nobody read on the way.
fn mapped_alone(frames: &[SimulatedFrame]) -> MapBuilder {
    let mut builder = builder();
    insert_all(&mut builder, frames);
    builder
}

#[test]
fn a_reader_sees_each_state_and_none_changes_under_it() {
    let frames = frames(16);
    let mut builder = builder();
    let reader = builder.reader();
    let mut held: Vec<(Arc<MultiLevelMap>, Vec<u8>)> = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        insert_all(&mut builder, std::slice::from_ref(frame));
        let latest = reader.latest();
        assert_eq!(latest.revision(), builder.map().revision());
        // Some ask what is static at once, some later, some never: it is shared between them and the builder.
        if index % 3 == 0 {
            assert!(fingerprint(&latest) == fingerprint(builder.map()));
            held.push((Arc::clone(&latest), fingerprint(&latest)));
        } else if index % 3 == 1 {
            latest.cloud().len();
        }
    }
    assert!(held.iter().all(|(map, before)| fingerprint(map) == *before));
    assert!(fingerprint(&reader.latest()) == fingerprint(mapped_alone(&frames).map()));
    assert!(fingerprint(builder.map()) == fingerprint(mapped_alone(&frames).map()));
}

#[test]
fn readers_follow_what_is_forgotten_moved_and_corrected() {
    let frames = frames(10);
    let (early, late) = frames.split_at(5);
    let mut builder = builder();
    let reader = builder.reader();
    insert_all(&mut builder, early);
    reader.latest().cloud().len();
    builder.forget_outside(early[0].world_from_camera.translation(), 2.0);
    let same = |reader: &MapReader, builder: &MapBuilder| {
        reader.latest().revision() == builder.map().revision()
            && fingerprint(&reader.latest()) == fingerprint(builder.map())
    };
    assert!(same(&reader, &builder));
    insert_all(&mut builder, late);
    assert!(same(&reader, &builder));
    let before = reader.latest();
    builder.transform(&Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()).unwrap();
    assert!(same(&reader, &builder) && reader.latest().revision() > before.revision());
    builder.settle();
    assert!(same(&reader, &builder));
}

/// A map that somebody has read is as good a beginning as the builder's own.
fn resumed(reader: &MapReader) -> MapBuilder {
    MapBuilder::resume(MultiLevelMap::clone(&reader.latest())).unwrap()
}

#[test]
fn what_readers_see_after_a_correction_has_the_corrected_poses() {
    let mut builder = builder();
    let reader = builder.reader();
    insert_all(&mut builder, &frames(6));
    builder.transform(&Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()).unwrap();
    assert_eq!(poses(&resumed(&reader)), poses(&builder));
}

#[test]
fn a_scan_that_readers_see_is_in_their_history() {
    let mut builder = builder();
    let reader = builder.reader();
    insert_all(&mut builder, &frames(2));
    let scan = [[2.0, 0.0, 0.5], [2.0, 0.1, 0.5]];
    let scan = builder.insert_scan(10.0, &scan, &Pose::identity()).unwrap();
    let mut read = resumed(&reader);
    for builder in [&mut builder, &mut read] {
        builder.remove(scan.id).unwrap();
    }
    assert!(fingerprint(read.map()) == fingerprint(builder.map()));
}

#[test]
fn whoever_waits_is_woken_and_whoever_waits_in_vain_is_told() {
    let frames = frames(6);
    let mut builder = builder();
    let reader = builder.reader();
    let nothing = reader.latest().revision();
    assert_eq!(nothing, Revision::default());
    assert!(reader.wait_newer(nothing, Duration::from_millis(1)).is_none());

    let is_done = Arc::new(AtomicBool::new(false));
    let watch = |reader: MapReader, is_done: Arc<AtomicBool>| {
        move || {
            let mut seen = vec![Revision::default()];
            while !is_done.load(Ordering::Relaxed) || reader.latest().revision() > *seen.last().unwrap() {
                if let Some(map) = reader.wait_newer(*seen.last().unwrap(), Duration::from_millis(20)) {
                    // What is given is whole: as many points as it says.
                    assert_eq!(map.cloud().len(), map.cloud().point_cloud(Selection::Static).len());
                    seen.push(map.revision());
                }
            }
            seen
        }
    };
    let watchers: Vec<_> =
        (0..2).map(|_| std::thread::spawn(watch(reader.clone(), Arc::clone(&is_done)))).collect();
    insert_all(&mut builder, &frames);
    is_done.store(true, Ordering::Relaxed);
    for watcher in watchers {
        let seen = watcher.join().unwrap();
        assert!(seen.is_sorted() && *seen.last().unwrap() == builder.map().revision(), "{seen:?}");
    }
    assert!(fingerprint(builder.map()) == fingerprint(mapped_alone(&frames).map()));
}

/// The first two frames, so many seconds after the last one.
fn later(frames: &[SimulatedFrame], seconds: f64) -> Vec<SimulatedFrame> {
    let last = frames.last().map_or(0.0, |one| one.frame.timestamp());
    let mut later = frames[..2].to_vec();
    for (step, one) in later.iter_mut().enumerate() {
        one.frame.set_timestamp(last + seconds + step as f64).unwrap();
    }
    later
}

#[test]
fn the_interval_is_kept_and_nobody_s_maps_are_not_published() {
    let frames = frames(20);
    let mut config = config();
    config.publish_interval = 1.0;
    let mut builder = MapBuilder::new(config).unwrap();
    let reader = builder.reader();
    let mut revisions = Vec::new();
    for frame in &frames {
        insert_all(&mut builder, std::slice::from_ref(frame));
        revisions.push(reader.latest().revision());
    }
    revisions.dedup();
    let seconds = frames[19].frame.timestamp() - frames[0].frame.timestamp();
    assert!((revisions.len() as f64 - seconds).abs() <= 1.5, "{} in {seconds} s", revisions.len());
    // Without a reader nothing published is kept, so that it does not hold what has changed since.
    let published = Arc::downgrade(&reader.latest());
    drop(reader);
    assert!(published.upgrade().is_some());
    insert_all(&mut builder, &later(&frames, 10.0));
    assert!(published.upgrade().is_none());
    // A new reader sees the maps as they stand.
    assert_eq!(builder.reader().latest().revision(), builder.map().revision());
}

#[test]
fn changes_applied_to_a_copy_are_the_map_over_a_session_with_a_correction() {
    let frames = frames(9);
    let mut builder = builder();
    let reader = builder.reader();
    let mut known = reader.latest();
    let mut copy = MapCopy::default();
    for (index, frame) in frames.iter().enumerate() {
        insert_all(&mut builder, std::slice::from_ref(frame));
        match index {
            3 => drop(builder.transform(&Pose::new([0.3, 0.1, 0.0], [0.0, 0.0, 0.6, 0.8]).unwrap()).unwrap()),
            5 => builder.forget_outside(frame.world_from_camera.translation(), 1.5),
            _ => {}
        }
        // Not every state is asked for.
        if index % 2 == 1 {
            continue;
        }
        let now = reader.latest();
        copy.follow(&known, &now);
        assert_eq!(copy.difference(&now), None);
        assert!(now.changes_since(&now).octree.is_empty() && now.changes_since(&now).cloud.is_empty());
        known = now;
    }
}

//! Sessions recorded for viewers, as MCAP.
#![cfg(feature = "mcap")]
use std::path::Path;

use crate::common::{config, fingerprint};
use dymlm::core::Pose;
use dymlm::files::SessionRecorder;
use dymlm::{MapBuilder, MapConfig};
use dymlm_io::{FrameBuffers, McapOptions, McapRecording, McapWriterOptions};
use dymlm_sim::SimulatedFrame;

/// People walk; the detector is right and wrong as ever. Times are whole nanoseconds and rotations have length
/// 1 to the last bit, as they come out of a file.
fn frames() -> Vec<SimulatedFrame> {
    let as_recorded = |mut one: SimulatedFrame| {
        one.frame.set_timestamp((one.frame.timestamp() * 1e9).round() / 1e9).unwrap();
        let pose = one.world_from_camera;
        one.world_from_camera = Pose::new(pose.translation(), pose.quaternion()).unwrap();
        one
    };
    crate::common::sequence(36).frames().step_by(3).map(as_recorded).collect()
}

/// Maps frames and records them, and the maps after every few.
fn record(path: &Path, options: &McapWriterOptions, frames: &[SimulatedFrame]) -> MapBuilder {
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut recorder = SessionRecorder::create(path, options).unwrap();
    for (index, one) in frames.iter().enumerate() {
        builder.insert(&one.frame, &one.detections, &one.world_from_camera).unwrap();
        recorder.record_frame(&one.frame, Some(&one.detections), &one.world_from_camera).unwrap();
        if index % 4 == 3 {
            recorder.record_map(one.frame.timestamp(), builder.map()).unwrap();
        }
    }
    recorder.finish().unwrap();
    builder
}

#[test]
fn a_map_of_the_recorded_session_is_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let original = record(&path, &McapWriterOptions::exact(), &frames());

    let mut recording = McapRecording::open(&path, &McapOptions::default()).unwrap();
    assert_eq!(recording.warnings(), [""; 0]);
    let sent = frames();
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut buffers = FrameBuffers::default();
    assert_eq!(recording.frames().len(), sent.len());
    for (index, sent) in sent.iter().enumerate() {
        let next = recording.load(index, &mut buffers).unwrap();
        assert_eq!(next.world_from_camera, sent.world_from_camera, "{index}");
        assert!(next.frame == sent.frame, "{index}");
        builder.insert(&next.frame, next.detections.as_deref(), &next.world_from_camera).unwrap();
        buffers.recycle(next.frame);
    }
    assert!(builder.map().planes().iter().count() > 1);
    assert!(fingerprint(builder.map()) == fingerprint(original.map()));
}

#[test]
fn nothing_new_costs_nothing_and_another_config_begins_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let length = || std::fs::metadata(&path).unwrap().len();
    let frames = frames();
    let mut builder = MapBuilder::new(config()).unwrap();
    crate::common::insert_all(&mut builder, &frames);
    let mut recorder = SessionRecorder::create(&path, &McapWriterOptions::default()).unwrap();
    recorder.set_up([0.0, 0.0, 3.0]);
    recorder.record_map(1.0, builder.map()).unwrap();
    let first = length();
    assert!(first > 10_000);
    recorder.record_map(2.0, builder.map()).unwrap();
    assert_eq!(length(), first, "the maps have not changed");

    let other = MapBuilder::new(MapConfig::default()).unwrap();
    recorder.record_map(3.0, other.map()).unwrap();
    let emptied = length() - first;
    assert!((1..first / 2).contains(&emptied), "{emptied} bytes that take away what was there");
    recorder.record_map(4.0, other.map()).unwrap();
    recorder.finish().unwrap();
}

#[test]
fn the_same_session_gives_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let frames = &frames()[..8];
    let files = ["a.mcap", "b.mcap"].map(|name| {
        let path = folder.path().join(name);
        record(&path, &McapWriterOptions::default(), frames);
        std::fs::read(path).unwrap()
    });
    assert!(files[0] == files[1]);
}

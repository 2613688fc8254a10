//! What publishing costs: memory for what has changed since the last time, whatever the maps hold elsewhere.
//! A file of its own, since the allocator counts for all tests of one.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "it/common/mod.rs"]
mod common;

use std::alloc::System;

use common::{config, sequence};
use dymlm::MapBuilder;
use dymlm::core::{Frame, Pose};
use dymlm_sim::SimulatedFrame;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Seconds and metres between one room and its next copy.
const APART: f64 = 100.0;

/// Maps a frame as if it had been taken in one of the copies of the room.
fn insert(builder: &mut MapBuilder, frame: &SimulatedFrame, room: usize) {
    let shift = APART * room as f64;
    let taken = &frame.frame;
    let (time, color) = (taken.timestamp() + shift, taken.color().cloned());
    let shifted = Frame::new(time, *taken.camera(), taken.depth().clone(), color).unwrap();
    let pose = Pose::new([shift, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap() * frame.world_from_camera;
    builder.insert(&shifted, &frame.detections, &pose).unwrap();
}

/// Bytes that are allocated for a publication alone, and for a last frame in the last of some copies of a
/// room with its publication.
fn bytes_of_a_frame(frames: &[SimulatedFrame], rooms: usize) -> [usize; 2] {
    let (last, before) = frames.split_last().unwrap();
    let mut config = config();
    config.publish_interval = 0.0;
    let mut builder = MapBuilder::new(config).unwrap();
    let reader = builder.reader();
    for room in 0..rooms {
        for frame in before {
            insert(&mut builder, frame, room);
        }
    }
    let held = reader.latest();
    let region = Region::new(ALLOCATOR);
    builder.settle();
    let publication = region.change().bytes_allocated;
    let region = Region::new(ALLOCATOR);
    insert(&mut builder, last, rooms - 1);
    let frame = region.change().bytes_allocated;
    assert!(reader.latest().revision() > held.revision());
    [publication, frame]
}

#[test]
fn a_published_frame_costs_what_it_has_changed() {
    let frames: Vec<SimulatedFrame> = sequence(24).frames().step_by(3).collect();
    let [one, twenty] = [1, 20].map(|rooms| bytes_of_a_frame(&frames, rooms));
    for (one, twenty) in one.into_iter().zip(twenty) {
        assert!(twenty as f64 <= 1.3 * one as f64, "{one} bytes in one room, {twenty} in twenty");
    }
}

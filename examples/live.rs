//! A camera, a mapper and a planner, each on its own thread, with a loop closure in the middle.
//!
//! The camera's odometry drifts. The planner queries the maps while they are built; neither waits for the
//! other. When the SLAM closes a loop, the mapper corrects the maps, and the planner uses the old ones until
//! they are corrected.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use dymlm::core::{FrameId, Pose};
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MapReader, MultiLevelMap, Revision};
use dymlm_examples::AnyError;
use dymlm_sim::{PoseErrorConfig, Sequence, SequenceConfig, SimulatedFrame};

/// Number of frames of the walk, at 10 Hz, and the second at which the loop closes.
const FRAMES: usize = 160;
const LOOP_CLOSES_AT: f64 = 10.0;

/// A message from the SLAM.
enum Event {
    /// A frame with detections and its current pose from odometry.
    Frame(Box<SimulatedFrame>),
    /// The poses of all frames so far, optimized.
    LoopClosure(Vec<Pose>),
}

fn main() -> Result<(), AnyError> {
    let sequence = drifting_walk()?;
    let mut config = MapConfig::default();
    // The observations of key frames are kept, so that they can be mapped again at corrected poses.
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config)?;
    let reader = builder.reader();
    let (send, receive) = sync_channel(4);
    let is_over = AtomicBool::new(false);

    thread::scope(|scope| -> Result<(), AnyError> {
        let sequence = &sequence;
        // With its own end of the channel, so that the mapper is told when it has stopped, for whatever reason.
        scope.spawn(move || camera(sequence, &send));
        let planner = scope.spawn(|| planner(&reader, &is_over));
        // The mapper runs on this thread. It ends when the camera does.
        let mapped = mapper(&mut builder, &receive);
        // After an error, the camera would wait for ever for somebody to take its frames.
        drop(receive);
        is_over.store(true, Ordering::Relaxed);
        let asked = planner.join().map_err(|_| "the planner panicked")?;
        mapped?;
        println!(
            "planner: {} maps read, {} places found near something, waited {:.3} ms for a map at the longest",
            asked.maps,
            asked.places,
            asked.longest_wait.as_secs_f64() * 1e3
        );
        Ok(())
    })
}

/// People walk through an office; the loop closes in the middle.
fn drifting_walk() -> Result<Sequence, AnyError> {
    let mut config = SequenceConfig::default();
    config.frames = FRAMES;
    config.pose_error = PoseErrorConfig::slam();
    config.pose_error.loop_closure = Some(LOOP_CLOSES_AT);
    Ok(Sequence::new(&config)?)
}

/// Sends frames, and the optimized poses when the loop closes.
fn camera(sequence: &Sequence, send: &SyncSender<Event>) {
    for (index, frame) in sequence.frames().enumerate() {
        if sequence.loop_closure_frame() == Some(index) {
            let before = index.saturating_sub(1);
            let optimized = sequence.corrected_poses(index).into_iter().take(before + 1).collect();
            if send.send(Event::LoopClosure(optimized)).is_err() {
                return;
            }
        }
        if send.send(Event::Frame(Box::new(frame))).is_err() {
            return;
        }
    }
}

/// Maps the incoming frames and follows loop closures.
fn mapper(builder: &mut MapBuilder, events: &Receiver<Event>) -> Result<(), AnyError> {
    // The SLAM numbers its frames itself.
    let mut ids: Vec<FrameId> = Vec::new();
    while let Ok(event) = events.recv() {
        match event {
            Event::Frame(next) => {
                let pose = &next.estimated_world_from_camera;
                ids.push(builder.insert(&next.frame, &next.detections, pose)?.id);
                if ids.len() == FRAMES {
                    break;
                }
            }
            Event::LoopClosure(poses) => {
                let optimized: Vec<(FrameId, Pose)> = ids.iter().copied().zip(poses).collect();
                let start = Instant::now();
                let report = builder.correct_poses(&optimized)?;
                println!(
                    "loop closure after {} frames: {} of {} key frames moved, a reading by up to {:.2} m, in {:.2?}",
                    ids.len(),
                    report.moved_key_frames,
                    report.key_frames,
                    report.largest_motion,
                    start.elapsed()
                );
                println!(
                    "  planes: {} merged, {} split; objects: {} merged, {} split",
                    report.planes.merged.len(),
                    report.planes.split.len(),
                    report.objects.merged.len(),
                    report.objects.split.len()
                );
            }
        }
    }
    builder.settle();
    let counts = builder.map().counts();
    println!(
        "mapper: {} points, {} planes, {} objects; history {:.1} MB",
        counts.cloud_points,
        counts.planes,
        counts.objects,
        builder.memory().history as f64 / 1e6
    );
    Ok(())
}

/// The statistics of the planner's queries.
#[derive(Default)]
struct Asked {
    maps: usize,
    places: usize,
    longest_wait: Duration,
}

/// Repeatedly reads the newest map and queries distances in it.
fn planner(reader: &MapReader, is_over: &AtomicBool) -> Asked {
    let mut asked = Asked::default();
    let mut newest = Revision::default();
    while !is_over.load(Ordering::Relaxed) {
        let start = Instant::now();
        let map = reader.latest();
        asked.longest_wait = asked.longest_wait.max(start.elapsed());
        if map.revision() == newest {
            // No newer map: sleep until there is one.
            reader.wait_newer(newest, Duration::from_millis(100));
            continue;
        }
        newest = map.revision();
        asked.maps += 1;
        asked.places += plan(&map);
    }
    asked
}

/// Queries the distance to the nearest obstacle at places all over the room; returns how many places are near
/// one.
fn plan(map: &MultiLevelMap) -> usize {
    let at = |i: i32, j: i32| [f64::from(i) * 0.5, f64::from(j) * 0.5, 0.5];
    let places = (-4..=4).flat_map(|i| (-4..=4).map(move |j| at(i, j)));
    let cloud = map.cloud().static_points();
    places.filter(|&place| cloud.nearest(place, 1.0).is_some()).count()
}

//! The cost of correcting poses, measured on the kitchen recording, whose frames are mapped to and fro until
//! there are enough key frames.
//!
//! `cargo run --release -p dymlm-benches --bin correction -- [KITCHEN] [KEY_FRAMES]`, for two cores with
//! `--features dymlm/parallel`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use dymlm::core::{FrameId, Pose};
use dymlm::{HistoryConfig, MapBuilder, MapConfig};
use dymlm_test_support::{RecordedFrame, processor_time, recorded_frames, recording};

type AnyError = Box<dyn Error>;

/// Seconds from one frame to the next.
const PERIOD: f64 = 1.0 / 6.0;
/// Number of key frames that a local optimization moves.
const FEW: usize = 10;

/// What some work has cost.
#[derive(Clone, Copy)]
struct Cost {
    wall: Duration,
    /// Processor time of all threads.
    processor: Duration,
}

fn main() -> Result<(), AnyError> {
    let mut arguments = std::env::args().skip(1);
    let folder = match arguments.next() {
        Some(folder) => PathBuf::from(folder),
        None => recording("kitchen").ok_or("no kitchen recording: see README.md")?,
    };
    let key_frames: usize = arguments.next().map_or(Ok(500), |text| text.parse())?;
    // Read beforehand, so that the files' decoding is no part of the processor time.
    let frames: Vec<RecordedFrame> = recorded_frames(&folder).collect();

    let (builder, without_history) = map(&frames, key_frames, HistoryConfig::None)?;
    drop(builder);
    let (mut builder, mapping) = map(&frames, key_frames, HistoryConfig::Memory)?;
    println!("{key_frames} key frames of {}", folder.display());
    print("mapped without history", without_history, without_history);
    print("mapped with history", mapping, without_history);
    let history = builder.memory().history;
    println!("history: {:.0} bytes a key frame\n", history as f64 / key_frames as f64);

    let mut correct = |name: &str, first: usize, end: usize| -> Result<(), AnyError> {
        let poses = drifted(&builder, first, end)?;
        let (report, cost) = measured(|| builder.correct_poses(&poses))?;
        print(&format!("{name}: {} moved", report.moved_key_frames), cost, mapping);
        Ok(())
    };
    let (middle, last) = ((key_frames.saturating_sub(FEW)) / 2, key_frames.saturating_sub(FEW));
    correct("all corrected", 0, key_frames)?;
    correct("all corrected again", 0, key_frames)?;
    correct("last corrected, the first time", last, key_frames)?;
    correct("last corrected again", last, key_frames)?;
    correct("middle corrected", middle, middle + FEW)?;
    println!("\nmemory of maps, history and snapshots: {:?}", builder.memory());
    Ok(())
}

/// Maps the frames to and fro.
fn map(
    frames: &[RecordedFrame],
    key_frames: usize,
    history: HistoryConfig,
) -> Result<(MapBuilder, Cost), AnyError> {
    let mut config = MapConfig::offline();
    config.history = history;
    let mut builder = MapBuilder::new(config)?;
    let to_and_fro = frames.iter().chain(frames.iter().rev()).cycle();
    let mut whole = Cost { wall: Duration::ZERO, processor: Duration::ZERO };
    for (recorded, count) in to_and_fro.take(key_frames).zip(0_u32..) {
        let mut frame = recorded.frame.clone();
        frame.set_timestamp(f64::from(count) * PERIOD)?;
        let insert = || builder.insert(&frame, &recorded.detections, &recorded.world_from_camera);
        let (_, cost) = measured(insert)?;
        whole.wall += cost.wall;
        whole.processor += cost.processor;
    }
    Ok((builder, whole))
}

/// The poses of frames that a slow drift has moved by up to 5 cm and half a degree; with the first and the
/// last frame, which would follow their neighbours if they were not named.
fn drifted(builder: &MapBuilder, first: usize, end: usize) -> Result<Vec<(FrameId, Pose)>, AnyError> {
    let trajectory: Vec<_> = builder.trajectory().collect();
    let moved = (first..end).map(|frame| {
        let (id, _, pose) = trajectory[frame];
        let phase = TAU * (frame - first + 1) as f64 / (end - first + 1) as f64;
        let turn = 0.5 * 0.5_f64.to_radians() * phase.sin();
        let drift = Pose::new(
            [0.05 * phase.sin(), 0.03 * (1.0 - phase.cos()), 0.02 * phase.sin()],
            [0.0, 0.0, turn.sin(), turn.cos()],
        )?;
        Ok((id, drift * pose))
    });
    let mut poses: Vec<_> = moved.collect::<Result<_, AnyError>>()?;
    let unmoved = [first.checked_sub(1), Some(end)].into_iter().flatten();
    poses.extend(unmoved.filter_map(|frame| trajectory.get(frame)).map(|&(id, _, pose)| (id, pose)));
    Ok(poses)
}

/// The output of `work`, and what it has cost.
fn measured<T, E>(work: impl FnOnce() -> Result<T, E>) -> Result<(T, Cost), E> {
    let (start, processor) = (Instant::now(), processor_time());
    let output = work()?;
    Ok((output, Cost { wall: start.elapsed(), processor: processor_time().saturating_sub(processor) }))
}

/// Prints a cost, and its processor time as a share of `of`'s.
fn print(name: &str, cost: Cost, of: Cost) {
    let share = 100.0 * cost.processor.as_secs_f64() / of.processor.as_secs_f64();
    println!(
        "{name}: {:.2} s, processor {:.2} s ({share:.0} %)",
        cost.wall.as_secs_f64(),
        cost.processor.as_secs_f64()
    );
}

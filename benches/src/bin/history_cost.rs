//! What a history costs: the time of `MapBuilder::insert` with one and without one, on the kitchen recording.
//!
//! `cargo run --release -p dymlm-benches --bin history_cost -- [ROUNDS] [KITCHEN]`
//!
//! Each round maps the recording once with a history and once without; a frame's time is its median over the
//! rounds, so that other work on the machine counts little.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::alloc::System;
use std::error::Error;
use std::path::PathBuf;
use std::time::Instant;

use dymlm::{HistoryConfig, MapBuilder, MapConfig, Stage};
use dymlm_test_support::{RecordedFrame, recorded_frames, recording};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

type AnyError = Box<dyn Error>;

/// What a frame's insertion took, in the rounds so far.
#[derive(Debug, Clone, Default)]
struct Insertions {
    /// Milliseconds.
    times: Vec<f64>,
    history_stage: Vec<f64>,
    /// Calls of the allocator, on all threads.
    calls: Vec<f64>,
}

fn main() -> Result<(), AnyError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let rounds: usize = arguments.first().map_or(Ok(5), |rounds| rounds.parse())?;
    let kitchen = match arguments.get(1) {
        Some(folder) => PathBuf::from(folder),
        None => recording("kitchen").ok_or("no kitchen recording: see README.md")?,
    };
    let frames: Vec<RecordedFrame> = recorded_frames(&kitchen).collect();
    let ways = [HistoryConfig::None, HistoryConfig::Memory];
    let mut measured = ways.each_ref().map(|_| vec![Insertions::default(); frames.len()]);
    for round in 0..rounds {
        // Which comes first takes turns.
        for place in 0..2 {
            let way = (round + place) % 2;
            map(&frames, &ways[way], &mut measured[way])?;
        }
    }
    let times = measured.each_ref().map(|frames| each(frames, |frame| &frame.times));
    let shares = times[1].iter().zip(&times[0]).map(|(with, without)| with / without);
    let more = 1e2 * (median(shares.collect()) - 1.0);
    println!(
        "insert: median {:.2} ms without, {:.2} ms with a history; the median frame is {more:.1} % dearer",
        median(times[0].clone()),
        median(times[1].clone())
    );
    let difference = times[1].iter().zip(&times[0]).map(|(with, without)| with - without);
    println!(
        "a frame takes {:.2} ms more (median), of which {:.2} ms on the caller's thread for the history",
        median(difference.collect()),
        median(each(&measured[1], |frame| &frame.history_stage))
    );
    let calls = measured.each_ref().map(|frames| median(each(frames, |frame| &frame.calls)));
    println!("calls of the allocator: {:.0} without, {:.0} with a history", calls[0], calls[1]);
    Ok(())
}

fn map(
    frames: &[RecordedFrame],
    history: &HistoryConfig,
    measured: &mut [Insertions],
) -> Result<(), AnyError> {
    let mut config = MapConfig::offline();
    config.history = history.clone();
    let mut builder = MapBuilder::new(config)?;
    for (seen, measured) in frames.iter().zip(measured) {
        let (region, start) = (Region::new(ALLOCATOR), Instant::now());
        let report = builder.insert(&seen.frame, &seen.detections, &seen.world_from_camera)?;
        measured.times.push(start.elapsed().as_secs_f64() * 1e3);
        let change = region.change();
        measured.calls.push((change.allocations + change.reallocations) as f64);
        let stage = report.stages.of(Stage::History).as_secs_f64() * 1e3;
        measured.history_stage.push(stage);
    }
    Ok(())
}

/// The median over the rounds, for each frame.
fn each(frames: &[Insertions], numbers: impl Fn(&Insertions) -> &[f64]) -> Vec<f64> {
    frames.iter().map(|frame| median(numbers(frame).to_vec())).collect()
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

//! The cost of saving and loading maps, and their size on disk, measured on the kitchen recording or on a
//! simulated building.
//!
//! `cargo run --release -p dymlm-benches --bin saving -- [KITCHEN]`
//! `cargo run --release -p dymlm-benches --bin saving -- building [ROOMS] [RATE] [SEED]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use dymlm::files::MapSaver;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_core::{Detection, Frame, Pose};
use dymlm_sim::{Sequence, SequenceConfig};
use dymlm_test_support::{recorded_frames, recording};

type AnyError = Box<dyn Error>;

/// What a builder takes in.
type Input = (Frame, Vec<Detection>, Pose);

/// Number of the kitchen's frames mapped before the first save; after each of the others, the map is saved
/// again.
const BEFORE: usize = 150;
/// Number of the building's frames mapped after the first save.
const AFTER: usize = 20;

fn main() -> Result<(), AnyError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|first| first == "building") {
        let argument =
            |place: usize, default: &str| arguments.get(place).map_or(default.to_owned(), String::clone);
        let (rooms, rate): (usize, f64) = (argument(1, "8").parse()?, argument(2, "2").parse()?);
        let mut config = SequenceConfig::building(argument(3, "1").parse()?, rooms);
        config.frames = (config.frames as f64 * rate / config.frame_rate).round() as usize;
        config.frame_rate = rate;
        let before = config.frames.saturating_sub(AFTER);
        let sequence = Sequence::new(&config)?;
        return measure_with_histories(before, || {
            sequence.frames().map(|seen| (seen.frame, seen.detections, seen.world_from_camera))
        });
    }
    let kitchen = match arguments.first() {
        Some(folder) => PathBuf::from(folder),
        None => recording("kitchen").ok_or("no kitchen recording: see README.md")?,
    };
    measure_with_histories(BEFORE, || {
        recorded_frames(&kitchen).map(|seen| (seen.frame, seen.detections, seen.world_from_camera))
    })
}

/// `before`: the number of frames mapped before the first save.
fn measure_with_histories<I: Iterator<Item = Input>>(
    before: usize,
    inputs: impl Fn() -> I,
) -> Result<(), AnyError> {
    let out = std::env::temp_dir().join(format!("dymlm-saving-{}", std::process::id()));
    for history in [HistoryConfig::None, HistoryConfig::Memory] {
        println!("history: {history:?}");
        measure(inputs(), before, history, &out)?;
        std::fs::remove_dir_all(&out)?;
    }
    Ok(())
}

fn measure(
    mut inputs: impl Iterator<Item = Input>,
    before: usize,
    history: HistoryConfig,
    out: &Path,
) -> Result<(), AnyError> {
    let mut config = MapConfig::offline();
    config.history = history;
    let mut builder = MapBuilder::new(config)?;
    for input in inputs.by_ref().take(before) {
        insert(&mut builder, &input)?;
    }
    let mut saver = MapSaver::create(out)?;
    let first = milliseconds(|| saver.save(builder.map()))?;
    let voxels = builder.map().cloud().held_voxels();
    let bytes = state_bytes(out)?;
    println!(
        "first save {first:.0} ms; state {:.1} MB, {:.1} bytes for each of {voxels} voxels",
        bytes as f64 / 1e6,
        bytes as f64 / voxels as f64
    );
    let mut saves = Vec::new();
    for input in inputs {
        insert(&mut builder, &input)?;
        saves.push(milliseconds(|| saver.save(builder.map()))?);
    }
    saves.sort_by(f64::total_cmp);
    let (median, most) = (saves[saves.len() / 2], saves[saves.len() - 1]);
    println!("save after one more frame: median {median:.0} ms, most {most:.0} ms");

    let mut loaded = None;
    let load = milliseconds(|| -> Result<(), AnyError> {
        loaded = Some(MultiLevelMap::load(out)?);
        Ok(())
    })?;
    let map = loaded.ok_or("just loaded")?;
    let query = milliseconds(|| -> Result<(), AnyError> {
        let points = map.cloud().point_cloud(Selection::Static).len();
        println!("{points} static points");
        Ok(())
    })?;
    println!("load {load:.0} ms, first static cloud {query:.0} ms");
    Ok(())
}

fn insert(builder: &mut MapBuilder, (frame, detections, pose): &Input) -> Result<(), AnyError> {
    builder.insert(frame, detections, pose)?;
    Ok(())
}

fn milliseconds<E>(work: impl FnOnce() -> Result<(), E>) -> Result<f64, E> {
    let start = Instant::now();
    work()?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// Bytes of the state's files in a map folder.
fn state_bytes(folder: &Path) -> Result<u64, AnyError> {
    let mut bytes = 0;
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_name().to_string_lossy().starts_with("state") {
            bytes += entry.metadata()?.len();
        }
    }
    Ok(bytes)
}

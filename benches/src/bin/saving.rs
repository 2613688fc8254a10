//! The cost of saving and loading maps, and their size on disk, measured on the kitchen recording.
//!
//! `cargo run --release -p dymlm-benches --bin saving -- [KITCHEN]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use dymlm::files::MapSaver;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_test_support::{RecordedFrame, recorded_frames, recording};

type AnyError = Box<dyn Error>;

/// Number of frames mapped before the first save; after each of the others, the map is saved again.
const BEFORE: usize = 150;

fn main() -> Result<(), AnyError> {
    let folder = match std::env::args().nth(1) {
        Some(folder) => PathBuf::from(folder),
        None => recording("kitchen").ok_or("no kitchen recording: see README.md")?,
    };
    let out = std::env::temp_dir().join(format!("dymlm-saving-{}", std::process::id()));
    for history in [HistoryConfig::None, HistoryConfig::Memory] {
        println!("history: {history:?}");
        measure(&folder, history, &out)?;
        std::fs::remove_dir_all(&out)?;
    }
    Ok(())
}

fn measure(kitchen: &Path, history: HistoryConfig, out: &Path) -> Result<(), AnyError> {
    let mut config = MapConfig::offline();
    config.history = history;
    let mut builder = MapBuilder::new(config)?;
    let mut frames = recorded_frames(kitchen);
    for frame in frames.by_ref().take(BEFORE) {
        insert(&mut builder, &frame)?;
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
    for frame in frames {
        insert(&mut builder, &frame)?;
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

fn insert(builder: &mut MapBuilder, recorded: &RecordedFrame) -> Result<(), AnyError> {
    builder.insert(&recorded.frame, &recorded.detections, &recorded.world_from_camera)?;
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

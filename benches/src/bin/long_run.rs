//! A day of mapping: a floor of rooms with people, walked through again and again at 1 Hz with small images.
//! Each hour the maps are saved and loaded, and a new session continues them; every two minutes the poses of
//! the last key frames are corrected; every second hour things have been moved. Prints the cost of each hour and
//! the size of the maps, which should all stay flat. Costs are processor time, which other work on the machine makes
//! longer by a tenth and more where two cores are two threads of one.
//!
//! `cargo run --release -p dymlm-benches --bin long_run -- [HOURS] [ROOMS] [SEED]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::path::Path;

use dymlm::core::{FrameId, PinholeCamera, Pose};
use dymlm::files::{LoadOptions, MapSaver};
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MapMemory, MultiLevelMap};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};
use dymlm_test_support::processor_time;

type AnyError = Box<dyn Error>;

const HOUR: f64 = 3600.0;
/// Seconds between two corrections, and number of key frames whose poses are corrected.
const CORRECTION: f64 = 120.0;
const CORRECTED: usize = 10;

/// A walk whose frames are rendered once.
struct Lap {
    frames: Vec<SimulatedFrame>,
    seconds: f64,
}

/// The costs of an hour, milliseconds.
#[derive(Default)]
struct Costs {
    inserts: Vec<f64>,
    corrections: Vec<f64>,
    save: f64,
    load: f64,
}

fn main() -> Result<(), AnyError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, default: u64| arguments.get(place).map_or(Ok(default), |text| text.parse());
    let (hours, rooms, seed) = (number(0, 24)?, number(1, 6)? as usize, number(2, 1)?);
    let laps = [lap(seed, rooms, 0)?, lap(seed, rooms, 1)?];
    let folder = std::env::temp_dir().join(format!("dymlm-long-run-{}", std::process::id()));

    let mut config = MapConfig::default();
    config.cloud.voxel_size = 0.02;
    config.memory.budget = Some(100_000_000);
    config.history = HistoryConfig::Folder(std::env::temp_dir());
    let (mut builder, mut saver) = (MapBuilder::new(config)?, MapSaver::create(&folder)?);
    for hour in 0..hours {
        let mut costs = Costs::default();
        walk(&mut builder, &laps[(hour / 2 % 2) as usize], &mut costs)?;
        let memory = builder.memory();
        let map;
        (saver, map) = save_and_load(builder.into_map(), saver, &mut costs)?;
        report(hour, &map, memory, &folder, costs)?;
        builder = MapBuilder::resume(map)?;
    }
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}

fn lap(seed: u64, rooms: usize, day: u64) -> Result<Lap, AnyError> {
    let mut config = SequenceConfig::building(seed, rooms);
    config.frames = (config.frames as f64 / config.frame_rate).round() as usize;
    (config.frame_rate, config.day) = (1.0, day);
    config.camera = Some(PinholeCamera::new(80, 60, 65.6, 65.6, 39.5, 29.5)?);
    let sequence = Sequence::new(&config)?;
    Ok(Lap { seconds: sequence.len() as f64, frames: sequence.frames().collect() })
}

/// Maps an hour of laps, in a session whose clock begins at 0.
fn walk(builder: &mut MapBuilder, lap: &Lap, costs: &mut Costs) -> Result<(), AnyError> {
    let mut corrected = 0.0;
    for round in 0..(HOUR / lap.seconds) as usize {
        for simulated in &lap.frames {
            let mut frame = simulated.frame.clone();
            frame.set_timestamp(frame.timestamp() + lap.seconds * round as f64)?;
            let insert = || builder.insert(&frame, &simulated.detections, &simulated.world_from_camera);
            costs.inserts.push(timed(insert)?.1);
            if frame.timestamp() - corrected >= CORRECTION {
                corrected = frame.timestamp();
                let last: Vec<(FrameId, Pose)> =
                    builder.trajectory().map(|(id, _, pose)| (id, pose)).collect();
                let last = &last[last.len().saturating_sub(CORRECTED)..];
                let shift = Pose::new([0.02, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])?;
                let moved: Vec<_> = last.iter().map(|&(id, pose)| (id, shift * pose)).collect();
                for poses in [moved.as_slice(), last] {
                    costs.corrections.push(timed(|| builder.correct_poses(poses))?.1);
                }
            }
        }
    }
    Ok(())
}

fn save_and_load(
    map: MultiLevelMap,
    mut saver: MapSaver,
    costs: &mut Costs,
) -> Result<(MapSaver, MultiLevelMap), AnyError> {
    costs.save = timed(|| saver.save(&map))?.1;
    let folder = saver.folder().to_path_buf();
    drop((map, saver));
    let (loaded, load) = timed(|| MapSaver::load(&folder, &LoadOptions::default()))?;
    costs.load = load;
    Ok(loaded)
}

/// `memory`: that of the builder at the end of the hour.
fn report(
    hour: u64,
    map: &MultiLevelMap,
    memory: MapMemory,
    folder: &Path,
    mut costs: Costs,
) -> Result<(), AnyError> {
    let mut bytes = 0;
    for file in std::fs::read_dir(folder)? {
        bytes += file?.metadata()?.len();
    }
    costs.inserts.sort_by(f64::total_cmp);
    let insert = |share: f64| costs.inserts[((costs.inserts.len() - 1) as f64 * share) as usize];
    let counts = map.counts();
    let maps = [memory.cloud, memory.octree, memory.planes, memory.objects, memory.history, memory.snapshots];
    println!(
        "hour {}: insert {:.1} ms, 95 % {:.1}, most {:.0}; correction {:.0} ms at most; save {:.0}, load {:.0}; \
         {} MB resident, cloud, octree, planes, objects, history, snapshots {:?} MB, {} on disk; \
         {} static points, {} planes, {} objects",
        hour + 1,
        insert(0.5),
        insert(0.95),
        insert(1.0),
        costs.corrections.iter().copied().fold(0.0, f64::max),
        costs.save,
        costs.load,
        dymlm_benches::resident_bytes()? / 1_000_000,
        maps.map(|bytes| bytes / 1_000_000),
        bytes / 1_000_000,
        counts.cloud_points,
        counts.planes,
        counts.objects
    );
    Ok(())
}

/// The output of `work`, and the processor time that passed meanwhile, milliseconds.
fn timed<T, E>(work: impl FnOnce() -> Result<T, E>) -> Result<(T, f64), E> {
    let start = processor_time();
    let result = work()?;
    Ok((result, processor_time().saturating_sub(start).as_secs_f64() * 1e3))
}

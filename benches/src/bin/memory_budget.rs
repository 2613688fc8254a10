//! The cost of a memory budget: a walk through a building, with the memory of the process, the times of
//! insertion and a checksum of the maps. Runs with a budget and without one must give the same checksum.
//!
//! `cargo run --release -p dymlm-benches --bin memory_budget -- [MEGABYTES|none] [ROOMS] [RATE] [SEED] [FRAMES]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::error::Error;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Instant;

use dymlm::{MapBuilder, MapConfig, Selection};
use dymlm_benches::resident_bytes;
use dymlm_sim::{Sequence, SequenceConfig};

type AnyError = Box<dyn Error>;

fn main() -> Result<(), AnyError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument =
        |place: usize, default: &str| arguments.get(place).map_or(default.to_owned(), String::clone);
    let (rooms, rate, seed): (usize, f64, u64) =
        (argument(1, "40").parse()?, argument(2, "2").parse()?, argument(3, "1").parse()?);
    let mut config = SequenceConfig::building(seed, rooms);
    config.frames = (config.frames as f64 * rate / config.frame_rate).round() as usize;
    config.frame_rate = rate;
    let sequence = Sequence::new(&config)?;

    let mut config = MapConfig::offline();
    let budget = argument(0, "512");
    if budget != "none" {
        config.memory.budget = Some((budget.parse::<f64>()? * 1e6) as usize);
    }
    let stop: Option<usize> = arguments.get(4).map(|text| text.parse()).transpose()?;
    let mut builder = MapBuilder::new(config)?;
    let before = resident_bytes()?;
    let (mut most, mut times) = (0.0_f64, Vec::new());
    for (index, simulated) in sequence.frames().enumerate() {
        let start = Instant::now();
        builder.insert(&simulated.frame, &simulated.detections, &simulated.world_from_camera)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        most = most.max(resident_bytes()?.saturating_sub(before) as f64 / 1e6);
        if (index + 1) % 200 == 0 {
            let memory = builder.memory();
            let mega =
                [memory.cloud, memory.octree, memory.planes, memory.objects].map(|bytes| bytes / 1_000_000);
            println!(
                "{} frames: {:.0} MB, {most:.0} at most; cloud, octree, planes, objects: {mega:?} MB",
                index + 1,
                resident_bytes()?.saturating_sub(before) as f64 / 1e6
            );
            if stop == Some(index + 1) {
                break;
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let quantile = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
    println!(
        "insert: median {:.1} ms, 95 % {:.1}, 99 % {:.1}, most {:.1}; mean {:.1}",
        quantile(0.5),
        quantile(0.95),
        quantile(0.99),
        quantile(1.0),
        times.iter().sum::<f64>() / times.len() as f64
    );
    let map = builder.into_map();
    let voxels = map.cloud().held_voxels();
    let start = Instant::now();
    println!(
        "{} static points, worked out in {:.1} s; then {:.0} MB",
        map.cloud().len(),
        start.elapsed().as_secs_f64(),
        resident_bytes()?.saturating_sub(before) as f64 / 1e6
    );
    println!("{voxels} voxels; checksum {:016x}", checksum(&map)?);
    println!("resident beside what was there before: {most:.0} MB at most");
    Ok(())
}

/// A checksum of the static cloud, the octree, the planes and the objects.
fn checksum(map: &dymlm::MultiLevelMap) -> Result<u64, AnyError> {
    let mut hasher = DefaultHasher::new();
    let cloud = map.cloud().point_cloud(Selection::Static);
    for point in cloud.points() {
        point.map(f32::to_bits).hash(&mut hasher);
    }
    cloud.colors().hash(&mut hasher);
    let mut octree = Vec::new();
    map.octree().write_ot(&mut octree)?;
    octree.hash(&mut hasher);
    for plane in map.planes().iter() {
        plane.plane().normal().map(f64::to_bits).hash(&mut hasher);
        plane.inlier_points().for_each(|point| point.map(f32::to_bits).hash(&mut hasher));
    }
    for object in map.objects().objects() {
        object.oriented_box().corners().as_flattened().iter().for_each(|c| c.to_bits().hash(&mut hasher));
    }
    Ok(hasher.finish())
}

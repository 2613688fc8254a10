//! Inspects saved maps and converts them to other files.
//!
//! `cargo run --release --example map -- info DIR`
//! `cargo run --release --example map -- changes DIR`
//! `cargo run --release --example map -- merge A B ... --out DIR [--poses FILE]`
//! `cargo run --release --example map -- grid DIR --out map.yaml [--at X Y Z] [--floors] [--inflate R] [--region X Y X Y] [--up X Y Z]`
//! `cargo run --release --example map -- gltf DIR --out map.glb [--up X Y Z]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

mod floor_grids;

use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};
use dymlm::core::Pose;
use dymlm::files::{LoadOptions, MapSaver};
use dymlm::{FoundObject, HistoryConfig, MapBuilder, MergeReport, MultiLevelMap, SessionChanges};
use dymlm_examples::{AnyError, Failure, read_pose, up_of_map};

use crate::floor_grids::GridArguments;

#[derive(Parser)]
#[command(about = "Inspects saved maps and converts them to other files")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Prints the contents of a map; for a damaged one, what is left
    Info {
        /// The map's folder
        map: PathBuf,
    },
    /// Prints what has moved, appeared or vanished according to each session of a map that was built with a
    /// history
    Changes {
        /// The map's folder
        map: PathBuf,
    },
    /// Merges several maps that were built with a history
    Merge {
        /// The maps' folders; merging is cheapest in the order of their times
        #[arg(required = true, num_args = 2..)]
        maps: Vec<PathBuf>,
        /// The merged map's folder
        #[arg(long)]
        out: PathBuf,
        /// A line for each map, "tx ty tz qx qy qz qw": takes the map's world to the common world. Without
        /// the file, all maps are in one world
        #[arg(long)]
        poses: Option<PathBuf>,
    },
    /// Makes 2D occupancy grids of floors (map.yaml and map.pgm, as ROS's map server reads them)
    Grid(GridArguments),
    /// Writes cloud, planes and objects as one glTF file, which browsers, Blender and others show
    Gltf {
        /// The map's folder
        map: PathBuf,
        /// The file
        #[arg(long, default_value = "map.glb")]
        out: PathBuf,
        /// The approximate up direction in the map's world, if the map does not know it: x y z
        #[arg(long, num_args = 3, allow_hyphen_values = true, value_names = ["X", "Y", "Z"])]
        up: Option<Vec<f64>>,
    },
}

fn main() -> Result<(), Failure> {
    Ok(match Arguments::parse().command {
        Command::Info { map } => info(&map),
        Command::Changes { map } => changes(&map),
        Command::Merge { maps, out, poses } => merge(&maps, &out, poses.as_deref()),
        Command::Grid(arguments) => floor_grids::write(&arguments),
        Command::Gltf { map, out, up } => gltf(&map, &out, up.as_deref().map(triple)),
    }?)
}

fn info(folder: &Path) -> Result<(), AnyError> {
    let (map, missing) = MultiLevelMap::load_partial(folder)?;
    for missing in &missing {
        println!("{} cannot be read: {}", missing.section, missing.error);
    }
    let (counts, memory) = (map.counts(), map.memory());
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    println!("revision {}", map.revision().get());
    println!(
        "cloud: {} static points of {} voxels of {} m, {:.1} MB",
        counts.cloud_points,
        counts.cloud_voxels,
        map.config().cloud.voxel_size,
        megabytes(memory.cloud)
    );
    println!(
        "octree: {} leaves of {} m or more, {} occupied, {:.1} MB",
        counts.octree_leaves,
        map.octree().resolution(),
        counts.octree_occupied_leaves,
        megabytes(memory.octree)
    );
    println!("planes: {}, {:.1} MB", counts.planes, megabytes(memory.planes));
    println!("objects: {}, {:.1} MB", counts.objects, megabytes(memory.objects));
    for object in map.objects().objects() {
        let [x, y, z] = object.oriented_box().world_from_box().translation();
        println!("  {} {} at {x:.2} {y:.2} {z:.2}, score {:.2}", object.id(), object.label(), object.score());
    }
    println!("history: {:.1} MB", megabytes(memory.history));
    for session in map.sessions() {
        let [from, to] = session.times;
        println!("  {} frames from frame {} on, {from:.1} s to {to:.1} s", session.frames, session.first);
    }
    if missing.is_empty() { Ok(()) } else { Err(format!("{} parts are damaged", missing.len()).into()) }
}

fn changes(folder: &Path) -> Result<(), AnyError> {
    for SessionChanges { session, changes, .. } in MultiLevelMap::load(folder)?.session_changes()? {
        println!("session from frame {} on:", session.first);
        for moved in &changes.moved {
            println!("  moved by {:.2} m: {} to {}", moved.distance(), found(&moved.from), place(&moved.to));
        }
        for appeared in &changes.appeared {
            println!("  appeared: {}", found(appeared));
        }
        for vanished in &changes.vanished {
            println!("  vanished: {}", found(vanished));
        }
    }
    Ok(())
}

fn found(object: &FoundObject) -> String {
    let [from, to] = object.seen;
    format!("{} {}, seen from {from:.1} s to {to:.1} s, at {}", object.id, object.label, place(object))
}

fn place(object: &FoundObject) -> String {
    let [x, y, z] = object.oriented_box.center();
    format!("{x:.2} {y:.2} {z:.2}")
}

fn merge(folders: &[PathBuf], out: &Path, poses: Option<&Path>) -> Result<(), AnyError> {
    let poses = match poses {
        Some(file) => read_poses(file)?,
        None => vec![Pose::identity(); folders.len()],
    };
    if poses.len() != folders.len() {
        return Err(format!("{} poses for {} maps", poses.len(), folders.len()).into());
    }
    // First, so that a folder that cannot be written is noticed before the merge.
    let mut saver = MapSaver::create(out)?;
    let load =
        |folder: &Path| MultiLevelMap::load(folder).map_err(|error| format!("{}: {error}", folder.display()));
    let (first, others) = folders.split_first().ok_or("no maps")?;
    let mut merged = load(first)?;
    if poses[0] != Pose::identity() {
        let mut builder = MapBuilder::resume(merged)?;
        builder.transform(&poses[0])?;
        merged = builder.into_map();
    }
    for (folder, world_from_map) in others.iter().zip(&poses[1..]) {
        let report = merged
            .merge(&load(folder)?, world_from_map)
            .map_err(|error| format!("{}: {error}", folder.display()))?;
        let MergeReport { sessions, key_frames, mapped_again, .. } = &report;
        println!(
            "{}: {} sessions, {key_frames} key frames, {mapped_again} of them mapped again",
            folder.display(),
            sessions.len()
        );
    }
    saver.save(&merged)?;
    Ok(())
}

/// Reads one pose from each line; empty lines and lines that begin with # are ignored.
fn read_poses(file: &Path) -> Result<Vec<Pose>, AnyError> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let lines =
        text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let poses = lines.map(|(number, line)| {
        read_pose(line).map_err(|error| format!("{}:{}: {error}", file.display(), number + 1).into())
    });
    poses.collect()
}

/// The three numbers of an argument.
pub(crate) fn triple(numbers: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| numbers.get(axis).copied().unwrap_or(0.0))
}

/// Loads a map without its history, whose folder need not be on the machine where somebody looks at the map.
pub(crate) fn load_to_look(folder: &Path) -> Result<MultiLevelMap, dymlm::Error> {
    let mut options = LoadOptions::default();
    options.history = Some(HistoryConfig::None);
    MultiLevelMap::load_with(folder, &options)
}

fn gltf(folder: &Path, out: &Path, up: Option<[f64; 3]>) -> Result<(), AnyError> {
    let map = load_to_look(folder)?;
    map.write_glb(out, up_of_map(&map, up)?)?;
    println!("{:.1} MB: {}", std::fs::metadata(out)?.len() as f64 / 1e6, out.display());
    Ok(())
}

//! Maps a recorded sequence, or without arguments a synthetic one, and writes the maps, pictures and a
//! report.
//!
//! `cargo run --release --example build_map -- [--sequence NAME | --dataset DIR] [--detections FILE]
//! [--trajectory FILE] [--corrections FILE] [--config FILE.toml] [--every N] [--out DIR]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::path::PathBuf;

use clap::Parser;
use dymlm::{FrameReport, HistoryConfig, MapBuilder, MapConfig, Selection};
use dymlm_examples::{
    AnyError, CorrectionCost, FrameSource, Picture, RunReport, cloud_pictures, every, mean_up,
    named_sequence, objects_from_above, objects_from_camera, octree_pictures, plane_pictures,
    planes_from_camera, progress_bar, timed, up_of_planes,
};
use dymlm_io::{MapFolderWriter, StampedPose, Trajectory, TumOptions};
use dymlm_sim::SequenceConfig;

/// Longest time between two poses of the corrections that is interpolated, seconds.
const LONGEST_GAP: f64 = 2.0;

/// Builds the maps of the static world from a recorded RGB-D sequence with people walking through it. Without
/// --dataset it renders a synthetic walking sequence and maps that.
#[derive(Parser)]
struct Arguments {
    /// TUM RGB-D folder
    #[arg(long)]
    dataset: Option<PathBuf>,
    #[arg(
        long,
        conflicts_with = "dataset",
        help = "Synthetic sequence: walking_xyz, sitting_rpy, ..., two_tables, random_room_0, ..."
    )]
    sequence: Option<String>,
    /// JSON-lines file or YOLO folder (with names.txt); default: the dataset's detections.jsonl
    #[arg(long, requires = "dataset")]
    detections: Option<PathBuf>,
    /// Poses, camera to world; default: the dataset's groundtruth.txt
    #[arg(long, requires = "dataset")]
    trajectory: Option<PathBuf>,
    /// Poses of a back end, camera to world, at any times: when all frames are in, the maps are corrected to
    /// them
    #[arg(long)]
    corrections: Option<PathBuf>,
    /// Settings; what the file leaves out stays at its default
    #[arg(long)]
    config: Option<PathBuf>,
    /// Take every N-th frame
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Folder for the results
    #[arg(long, default_value = "out/map")]
    out: PathBuf,
}

fn main() -> Result<(), AnyError> {
    let arguments = Arguments::parse();
    let mut config = read_config(&arguments)?;
    let corrections = arguments.corrections.as_ref().map(Trajectory::read).transpose()?;
    if corrections.is_some() && config.history == HistoryConfig::None {
        config.history = HistoryConfig::Memory;
    }
    let mut source = open_source(&arguments)?;
    // Claimed first: an output folder that cannot be written shall not cost a run.
    let mut folder = MapFolderWriter::create(&arguments.out)?;

    let mut builder = MapBuilder::new(config)?;
    let reports = insert_all(&mut builder, &mut source);
    if reports.is_empty() {
        return Err("no frame could be mapped; nothing is written".into());
    }
    builder.settle();
    let corrected = corrections.map(|poses| correct(&mut builder, &poses)).transpose()?;

    let cloud = builder.map().cloud().point_cloud(Selection::Static);
    let mut report = RunReport::new(source.len(), &reports, &builder);
    report.corrections = corrected;
    let up = mean_up((0..source.len()).filter_map(|index| source.pose(index)));
    let up = up_of_planes(builder.map().planes(), up);
    let voxel_size = builder.config().cloud.voxel_size;
    let mut pictures = cloud_pictures(&cloud, up, voxel_size);
    pictures.extend(octree_pictures(builder.map().octree(), up));
    pictures.extend(plane_pictures(builder.map().planes(), up));
    pictures.push(objects_from_above(builder.map().objects(), &cloud, up));
    // The middle of the run is drawn as the camera saw it.
    if let Ok(middle) = source.load(source.len() / 2) {
        let objects = builder.map().objects();
        pictures.push(objects_from_camera(objects, &middle.frame, &middle.world_from_camera));
        pictures.push(planes_from_camera(builder.map().planes(), &middle.frame, &middle.world_from_camera));
    }

    builder.map().write_files(&mut folder)?;
    write_pictures(&mut folder, &pictures)?;
    folder.file("report.json", |out| -> Result<(), AnyError> {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        Ok(writeln!(out)?)
    })?;
    let trajectory = mapped_trajectory(&builder, &source)?;
    folder.file("trajectory.txt", |out| trajectory.encode(out))?;
    folder.finish(&report.config, &report.counts)?;

    print_summary(&report, &arguments);
    Ok(())
}

fn read_config(arguments: &Arguments) -> Result<MapConfig, AnyError> {
    let Some(path) = &arguments.config else { return Ok(MapConfig::default()) };
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    MapConfig::from_toml(&text).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn open_source(arguments: &Arguments) -> Result<FrameSource, AnyError> {
    let mut options = TumOptions::default();
    options.trajectory.clone_from(&arguments.trajectory);
    options.every = arguments.every;
    if let Some(folder) = &arguments.dataset {
        return FrameSource::recorded(folder, arguments.detections.as_deref(), &options);
    }
    let config = match &arguments.sequence {
        Some(name) => named_sequence(name)?.config,
        None => SequenceConfig::default(),
    };
    FrameSource::synthetic(&every(config, arguments.every))
}

/// Feeds every frame to the builder. A frame that cannot be loaded or is refused costs a warning, no more.
fn insert_all(builder: &mut MapBuilder, source: &mut FrameSource) -> Vec<FrameReport> {
    let bar = progress_bar(source.len(), "mapping");
    let warn = |text: String| bar.suspend(|| eprintln_warning(&text));
    source.faults().into_iter().for_each(&warn);
    let mut reports = Vec::new();
    for index in 0..source.len() {
        match source.load(index) {
            Ok(next) => {
                match builder.insert(&next.frame, next.detections.as_deref(), &next.world_from_camera) {
                    Ok(report) => reports.push(report),
                    Err(error) => warn(format!("frame {index} skipped: {error}")),
                }
                source.recycle(next);
            }
            Err(error) => warn(format!("frame {index} skipped: {error}")),
        }
        bar.inc(1);
    }
    bar.finish();
    reports
}

/// Lets the maps follow the poses of a back end; frames that it says nothing of move with their neighbours.
fn correct(builder: &mut MapBuilder, poses: &Trajectory) -> Result<CorrectionCost, AnyError> {
    let new_pose = |(id, time, _)| Some((id, poses.pose_at(time, LONGEST_GAP).ok()?));
    let given: Vec<_> = builder.trajectory().filter_map(new_pose).collect();
    if given.is_empty() {
        return Err("no frame was taken at a time of the corrections".into());
    }
    let bar = progress_bar(0, "correcting");
    let (report, cost) = timed(|| {
        builder.correct_poses_watched(&given, &mut |progress| {
            bar.set_length(progress.total as u64);
            bar.set_position(progress.done as u64);
            true
        })
    });
    bar.finish();
    Ok(CorrectionCost { key_frames: report?.moved_key_frames, ..cost })
}

/// Where the frames were taken from, as they are mapped.
fn mapped_trajectory(builder: &MapBuilder, source: &FrameSource) -> Result<Trajectory, AnyError> {
    let corrected = builder.trajectory().map(|(_, time, pose)| (time, pose));
    let mut poses: Vec<_> = corrected.collect();
    if poses.is_empty() {
        // Without a history as they were given.
        poses.extend(
            (0..source.len()).filter_map(|index| Some((source.timestamp(index)?, source.pose(index)?))),
        );
    }
    let stamped = |(timestamp, world_from_camera)| StampedPose { timestamp, world_from_camera };
    Ok(Trajectory::new(poses.into_iter().map(stamped).collect())?)
}

#[allow(clippy::print_stderr, reason = "warnings of a program for the terminal")]
fn eprintln_warning(text: &str) {
    eprintln!("warning: {text}");
}

fn write_pictures(folder: &mut MapFolderWriter, pictures: &[Picture]) -> Result<(), AnyError> {
    for picture in pictures {
        folder.file(picture.name, |out| picture.encode_png(out))?;
    }
    Ok(())
}

fn print_summary(report: &RunReport, arguments: &Arguments) {
    println!(
        "{} of {} frames taken in ({} skipped), {} key frames mapped",
        report.frames - report.frames_skipped,
        report.frames,
        report.frames_skipped,
        report.key_frames
    );
    println!("{:>13}  median    p95    max ms", "step");
    for (name, time) in &report.stages {
        println!("{name:>13}  {:6.2} {:6.2} {:6.2}", time.median_ms, time.p95_ms, time.max_ms);
    }
    let counts = &report.counts;
    println!("cloud: {} points ({} voxels before late removal)", counts.cloud_points, counts.cloud_voxels);
    println!("octree: {} leaves, {} occupied", counts.octree_leaves, counts.octree_occupied_leaves);
    println!("planes: {}", counts.planes);
    println!("objects: {}", counts.objects);
    let megabytes = |bytes: f64| bytes / 1e6;
    let memory = report.memory_bytes;
    let memory =
        [memory.cloud, memory.octree, memory.planes, memory.objects, memory.history + memory.snapshots];
    let [cloud, octree, planes, objects, history] = memory.map(|bytes| megabytes(bytes as f64));
    println!(
        "memory: cloud {cloud:.1}, octree {octree:.1}, planes {planes:.1}, objects {objects:.1}, history {history:.1} MB"
    );
    if let Some(cost) = &report.corrections {
        let CorrectionCost { key_frames, wall_ms, cpu_ms } = cost;
        println!("corrected: {key_frames} key frames moved, {wall_ms:.0} ms, processor {cpu_ms:.0} ms");
    }
    if let Some(bytes) = report.peak_memory_bytes {
        println!("peak memory: {:.0} MB", megabytes(bytes as f64));
    }
    println!("written to {}", arguments.out.display());
}

//! Measures all maps: on the synthetic sequences against their exact truth, or on a recording against another
//! recording of the same place without people.
//!
//! `cargo run --release --example evaluate -- [--baseline] [--quick] [--every N] [--random-rooms N] [--out
//! DIR]` prints one table, one block for each map, and writes it as `evaluation.json` and `evaluation.md`;
//! `--baseline` also treats movers in the paper's ways. `--quick` takes two short sequences and fails when a
//! figure is worse than its limit.
//!
//! `--sensors` maps `walking_xyz` as seen by several depth cameras, each with its own sensor model;
//! `--detector-rate 10` takes sequences at 30 Hz, once with detections in each frame and once in every third;
//! a building keeps its `--rate`, of which the detector's is a share.
//!
//! `--unlabelled` takes sequences with people and things that move and are never detected, `--fresh SEED`
//! other people in other rooms (both: undetected movers in these rooms); `--no-detections` and `--min-score
//! 0.7` withhold detections.
//!
//! `--building SEED` takes a floor of a building instead, `--rooms 8` of them, with `--rate 5` frames a
//! second; `--robot`, `--pitch 60` and `--roll 90` say how the camera is held. Fails when a figure is worse
//! than its limit.
//!
//! `--floor-plan FILE.yaml` takes a building with the walls of a floor plan as ROS's map server reads them instead,
//! furnished from `--seed N`, with at most `--frames N` frames; `--rate` and how the camera is held as above. It writes
//! a picture of the map from above beside the plan.
//!
//! `--recordings SEED` takes a building in eight recordings, of which two were made on another day after
//! things were moved, merges their maps and compares the changes that they report with the truth.
//!
//! `--pose-noise`, `--drift-share 0.05` or `--recorded-drift FILE --true-path FILE` make the poses drift;
//! `--correct` also corrects the maps to the true poses at the end, and compares true, drifting and corrected
//! poses.
//!
//! `cargo run --release --example evaluate -- --dataset DIR --reference DIR` measures a recording.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

mod change_watch;
mod columns;
mod days;
mod drift;
mod evaluation;
mod floor_plan;
mod limits;
mod recording;
mod residue_picture;
mod run;
mod standard;
mod subjects;
mod table;
mod treatment;

use std::path::PathBuf;

use clap::Parser;
use dymlm_examples::AnyError;

use crate::drift::DriftArguments;
use crate::evaluation::{Row, Ways};
use crate::treatment::Treatment;

/// Measures the maps, one row for each sequence and treatment of movers.
#[derive(Parser)]
#[allow(clippy::struct_excessive_bools, reason = "switches of a command line")]
struct Arguments {
    /// Also treats movers in the paper's ways, each before and after late removal
    #[arg(long)]
    baseline: bool,
    /// Takes two short sequences and fails when a figure is worse than its limit
    #[arg(long, conflicts_with_all = ["dataset", "baseline", "every"])]
    quick: bool,
    /// Only every N-th frame
    #[arg(long, default_value_t = 1)]
    every: usize,
    /// Leaves the times out, which say little when the machine has other work
    #[arg(long)]
    no_times: bool,
    /// Number of random rooms
    #[arg(long, default_value_t = 4)]
    random_rooms: u64,
    /// Seed of the first random room; the others have the seeds after it
    #[arg(long, default_value_t = 0)]
    first_room: u64,
    #[command(flatten)]
    drift: DriftArguments,
    /// Other depth cameras instead: stereo, time of flight, 320x240, 1280x720, 110 degrees of view, rolled;
    /// fails when a figure is worse than its limit
    #[arg(long, conflicts_with_all = ["dataset", "baseline", "quick"])]
    sensors: bool,
    /// Takes frames at 30 Hz (in a building at its rate), once with detections in all of them and once only this
    /// many times a second; of 2 and more, fails when a figure is worse than its limit
    #[arg(long, conflicts_with_all = ["dataset", "baseline", "quick", "sensors"])]
    detector_rate: Option<f64>,
    /// Sequences with people and things that move and are never detected instead
    #[arg(long, conflicts_with_all = ["dataset", "quick", "sensors", "detector_rate"])]
    unlabelled: bool,
    /// Sequences with other people, rooms, paths and noise, drawn from this seed, instead
    #[arg(long, value_name = "SEED", conflicts_with_all = ["dataset", "quick", "sensors", "detector_rate"])]
    fresh: Option<u64>,
    /// A floor of a building generated from this seed instead
    #[arg(
        long,
        value_name = "SEED",
        conflicts_with_all = ["dataset", "quick", "sensors", "unlabelled", "fresh"],
        group = "place"
    )]
    building: Option<u64>,
    /// A floor of a building in eight recordings of two days instead: scores the changes found between them
    #[arg(
        long,
        value_name = "SEED",
        conflicts_with_all = [
            "dataset", "quick", "sensors", "unlabelled", "fresh", "building", "every", "baseline", "drift",
            "detector_rate", "no_detections", "min_score", "only", "markdown"
        ]
    )]
    recordings: Option<u64>,
    /// A building with the walls of this floor plan instead: a .yaml file as ROS's map server reads it
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = ["dataset", "quick", "sensors", "unlabelled", "fresh", "recordings"],
        group = "place"
    )]
    floor_plan: Option<PathBuf>,
    /// With a floor plan: decides about furniture, people and the camera's way
    #[arg(long, default_value_t = 1, requires = "floor_plan")]
    seed: u64,
    /// With a floor plan: the greatest number of frames. When they do not suffice, less of the plan is shown
    #[arg(long, default_value_t = 2000, requires = "floor_plan")]
    frames: usize,
    /// With a floor plan: height of the walls, metres
    #[arg(long, default_value_t = 2.8, requires = "floor_plan")]
    wall_height: f64,
    /// Number of a building's rooms
    #[arg(long, default_value_t = 8)]
    rooms: usize,
    /// Frames a second in a building
    #[arg(long, default_value_t = 5.0)]
    rate: f64,
    /// In the building, the camera is on a robot, 0.3 m above the floor
    #[arg(long, requires = "place")]
    robot: bool,
    /// In the building, the camera looks down by this many degrees
    #[arg(long, default_value_t = 0.0, requires = "place")]
    pitch: f64,
    /// In the building, the camera is rolled by this many degrees
    #[arg(long, default_value_t = 0.0, requires = "place")]
    roll: f64,
    /// No detections at all
    #[arg(long, conflicts_with_all = ["dataset", "baseline", "quick"])]
    no_detections: bool,
    /// Only detections of at least this score
    #[arg(long, default_value_t = 0.0, conflicts_with = "dataset")]
    min_score: f32,
    /// Only sequences whose names contain this
    #[arg(long)]
    only: Option<String>,
    /// Folder for the table as JSON and Markdown, and for the pictures
    #[arg(long, default_value = "out/evaluate")]
    out: PathBuf,
    /// File for the table as Markdown, as a page of its own
    #[arg(long)]
    markdown: Option<PathBuf>,
    /// TUM RGB-D folder with people; exact masks in masks/ are used when there are any
    #[arg(long, requires = "reference")]
    dataset: Option<PathBuf>,
    /// TUM RGB-D folder of the same place without people: all its frames form the reference cloud
    #[arg(long, requires = "dataset")]
    reference: Option<PathBuf>,
    /// Detection file; default: the dataset's detections.jsonl
    #[arg(long, requires = "dataset")]
    detections: Option<PathBuf>,
}

fn main() -> Result<(), AnyError> {
    let arguments = Arguments::parse();
    if let (Some(dataset), Some(reference)) = (&arguments.dataset, &arguments.reference) {
        let detections = arguments.detections.as_deref();
        return recording::evaluate(dataset, reference, detections, arguments.every);
    }

    // The output folder is created first, so that an unwritable one is noticed before the run.
    std::fs::create_dir_all(&arguments.out)?;
    if let Some(seed) = arguments.recordings {
        return days::evaluate(seed, arguments.rooms, arguments.rate, &arguments.out);
    }
    let mut subjects = if arguments.quick {
        subjects::quick()?
    } else if arguments.sensors {
        subjects::sensors(arguments.every)?
    } else if arguments.unlabelled {
        subjects::undetected(arguments.fresh, arguments.every)?
    } else if let Some(seed) = arguments.building {
        vec![subjects::building(&arguments, seed)?]
    } else if let Some(file) = &arguments.floor_plan {
        vec![floor_plan::subject(&arguments, file)?]
    } else if let Some(seed) = arguments.fresh {
        subjects::fresh(seed, arguments.every)?
    } else {
        subjects::chosen(&arguments)?
    };
    if let Some(part) = &arguments.only {
        subjects.retain(|subject| subject.name.contains(part));
    }
    let treatments = match arguments {
        Arguments { baseline: true, .. } => Treatment::ALL,
        Arguments { no_detections: true, .. } => &[Treatment::NoDetections],
        _ => &[Treatment::Silhouettes],
    };
    if let Some(rate) = arguments.detector_rate {
        subjects.iter_mut().try_for_each(|subject| subject.add_slow_detector(rate))?;
    }
    arguments.drift.apply(&mut subjects)?;
    let (min_score, poses) = (arguments.min_score, arguments.drift.poses());
    let ways = Ways { treatments, min_score, poses };
    let evaluations = evaluation::evaluate(&subjects, &ways)?;
    for (subject, evaluation) in subjects.iter().zip(&evaluations) {
        if let Some(picture) = &evaluation.beside_plan {
            picture.write(&subject.name, &arguments.out)?;
        }
        residue_picture::write(&evaluation.panels, &subject.name, &arguments.out)?;
    }
    let mut rows: Vec<Row> = evaluations.into_iter().flat_map(|evaluation| evaluation.rows).collect();
    if arguments.no_times {
        for row in &mut rows {
            row.scores.remove_times();
        }
    }
    print!("{}", table::text(&rows));
    table::write(&rows, &arguments.out)?;
    println!("written to {}", arguments.out.display());
    if let Some(file) = &arguments.markdown {
        table::write_page(&rows, file)?;
        println!("written to {}", file.display());
    }
    let is_slow_detector = arguments.detector_rate.is_some_and(|rate| rate >= limits::SLOWEST_DETECTOR);
    if arguments.quick {
        limits::check(&rows, limits::QUICK)
    } else if arguments.sensors && arguments.only.is_none() {
        limits::check(&rows, limits::SENSORS)
    } else if arguments.unlabelled && arguments.only.is_none() && arguments.fresh.is_none() {
        limits::check(&rows, limits::UNDETECTED)
    } else if arguments.building.is_some() {
        limits::check(&rows, limits::BUILDING)
    } else if is_slow_detector && arguments.only.is_none() {
        limits::check(&rows, limits::SLOW_DETECTOR)
    } else {
        Ok(())
    }
}

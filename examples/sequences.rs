//! The synthetic sequences, to look at and to give to other systems.
//!
//! - `cargo run --release --example sequences` writes a frame of each as PNG, colour beside depth.
//! - `... -- export NAME DIR` writes a whole sequence as a TUM RGB-D folder with its detections.
//! - `... -- detector [--dataset DIR]` prints the error statistics of the simulated detector, and beside them
//!   a real detector's on a recording with exact masks.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};
use dymlm_examples::{AnyError, FrameSource, depth_colors, named_sequence, named_sequences, progress_bar};
use dymlm_io::{TumOptions, TumWriter, write_png};
use dymlm_sim::{Activity, Sequence, SequenceType, SimulatedFrame};
use dymlm_test_support::{DetectorFigures, DetectorStatistics, ExactView};

/// Draws, exports and describes the synthetic sequences.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// A frame of each sequence as PNG, colour beside depth (the default)
    Pictures {
        /// Folder for the pictures
        #[arg(long, default_value = "out/sequences")]
        out: PathBuf,
        /// Index of the frame
        #[arg(long, default_value_t = 40)]
        frame: usize,
        /// Number of random rooms
        #[arg(long, default_value_t = 4)]
        random_rooms: u64,
    },
    /// Writes a whole sequence as a TUM RGB-D folder
    Export {
        #[arg(help = "walking_xyz, sitting_rpy, ..., two_tables, random_room_0, ...")]
        name: String,
        /// The folder, which must be empty or not exist yet
        folder: PathBuf,
    },
    /// Prints the error statistics of the simulated detector, beside a real one's
    Detector {
        /// TUM RGB-D folder with detections.jsonl and exact masks in masks/
        #[arg(long)]
        dataset: Option<PathBuf>,
    },
}

fn main() -> Result<(), AnyError> {
    let command = Arguments::parse().command;
    match command {
        None => draw_all(Path::new("out/sequences"), 40, 4),
        Some(Command::Pictures { out, frame, random_rooms }) => draw_all(&out, frame, random_rooms),
        Some(Command::Export { name, folder }) => export(&name, &folder),
        Some(Command::Detector { dataset }) => describe_detector(dataset.as_deref()),
    }
}

fn draw_all(out: &Path, frame: usize, random_rooms: u64) -> Result<(), AnyError> {
    std::fs::create_dir_all(out)?;
    for named in named_sequences(0..random_rooms) {
        let sequence = Sequence::new(&named.config)?;
        let index = frame.min(sequence.len().saturating_sub(1));
        let frame = sequence.frame(index).ok_or("a sequence without frames")?;
        let path = out.join(format!("{}.png", named.name));
        let (width, height, pixels) = side_by_side(&frame);
        write_png(&path, width, height, &pixels)?;
        println!("{}: frame {index} of {}", path.display(), sequence.len());
    }
    Ok(())
}

/// Colour to the left, depth to the right.
fn side_by_side(frame: &SimulatedFrame) -> (usize, usize, Vec<[u8; 3]>) {
    let depth = frame.frame.depth();
    let (width, height) = (depth.width(), depth.height());
    let black = vec![[0; 3]; width * height];
    let color = frame.frame.color().map_or(black.as_slice(), |color| color.data());
    let depth = depth_colors(depth);
    let rows = color.chunks(width).zip(depth.chunks(width));
    (2 * width, height, rows.flat_map(|(color, depth)| [color, depth].concat()).collect())
}

fn export(name: &str, folder: &Path) -> Result<(), AnyError> {
    let sequence = Sequence::new(&named_sequence(name)?.config)?;
    let mut writer = TumWriter::create(folder, sequence.camera())?;
    let bar = progress_bar(sequence.len(), name);
    for frame in sequence.frames() {
        writer.write(&frame.frame, &frame.detections, &frame.world_from_camera)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    writer.finish()?;
    println!("{} frames written to {}", sequence.len(), folder.display());
    Ok(())
}

/// Prints the figures of the simulated detector over the four walking sequences, and of a real one beside
/// them.
fn describe_detector(dataset: Option<&Path>) -> Result<(), AnyError> {
    let simulated = simulated_detector()?;
    let real = dataset.map(real_detector).transpose()?;
    println!("{:<48} {:>10} {:>10}", "", "simulated", if real.is_some() { "real" } else { "" });
    for (index, row) in simulated.rows().iter().enumerate() {
        let real =
            real.as_ref().and_then(|real| real.rows().get(index).map(|row| format!("{:10.3}", row.value)));
        println!("{:<48} {:10.3} {}", row.name, row.value, real.unwrap_or_default());
    }
    Ok(())
}

fn simulated_detector() -> Result<DetectorFigures, AnyError> {
    let mut statistics = DetectorStatistics::new("person");
    for kind in SequenceType::ALL.iter().filter(|kind| kind.activity() == Activity::Walking) {
        let sequence = Sequence::new(&kind.config())?;
        let bar = progress_bar(sequence.len(), kind.name());
        for frame in sequence.frames() {
            let movers = frame.visible_things.iter().filter(|thing| thing.moves);
            let views: Vec<ExactView> =
                movers.map(|thing| ExactView::new(thing.id, thing.bounding_box, thing.pixels)).collect();
            statistics.add(&frame.detections, &views, &frame.mover_mask);
            bar.inc(1);
        }
        bar.finish_and_clear();
    }
    statistics.figures().ok_or_else(|| "nobody is in view".into())
}

/// The figures of the detections of a recording whose masks have the values 1, 2, ... on people.
fn real_detector(folder: &Path) -> Result<DetectorFigures, AnyError> {
    let mut source = FrameSource::recorded(folder, None, &TumOptions::default())?;
    let mut statistics = DetectorStatistics::new("person");
    for index in 0..source.len() {
        let next = source.load(index)?;
        let people = source.people(index)?.ok_or("the dataset has no folder masks")?;
        let masks = people.each()?;
        let views: Vec<ExactView> =
            masks.iter().enumerate().filter_map(|(id, mask)| ExactView::of_mask(id, mask)).collect();
        statistics.add(next.detections.as_deref().unwrap_or_default(), &views, &people.anybody()?);
        source.recycle(next);
    }
    statistics.figures().ok_or_else(|| "nobody is in view".into())
}

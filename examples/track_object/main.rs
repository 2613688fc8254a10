//! Follows an object of the map that a hand moves, and brings it to its new place in all maps (the paper's
//! section V-D).
//!
//! `cargo run --release --example track_object -- [--dataset DIR --object LABEL [--map-until SECONDS]]
//! [--no-depth] [--out DIR]` maps, chooses an object and follows it; it writes `poses_LABEL.txt` (TUM format,
//! world from object), a picture strip `object_tracking.png`, and, where there is truth, prints the errors.
//! Without --dataset a hand carries a book and then a bottle through the rendered office.
//!
//! `... -- --ten-sequences [--no-depth] [--handheld] [--only TEXT]` prints the table of the ten synthetic
//! sequences, and fails when one of them misses its bounds.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

mod carried_run;
mod errors;
mod follow;
mod recorded_run;
mod strip;
mod ten_sequences;
mod visibility;

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use clap::Parser;
use dymlm_examples::AnyError;
use dymlm_sim::CarriedKind;

use crate::follow::Followed;
use crate::strip::Strip;

/// Maps, chooses an object of the map, and follows it while a hand moves it.
#[derive(Parser)]
struct Arguments {
    /// TUM RGB-D folder in which an object is moved
    #[arg(long, requires = "object")]
    dataset: Option<PathBuf>,
    /// Label of the object to follow; of several, the one nearest to the camera
    #[arg(long, requires = "dataset")]
    object: Option<String>,
    /// Time, seconds after the first frame, until which the object is mapped and from which it is followed
    #[arg(long, default_value_t = 2.0)]
    map_until: f64,
    /// Tracks from colour alone
    #[arg(long)]
    no_depth: bool,
    /// Prints the table of ten synthetic sequences instead
    #[arg(long, conflicts_with = "dataset")]
    ten_sequences: bool,
    /// With --ten-sequences: the camera is carried by hand too
    #[arg(long, requires = "ten_sequences")]
    handheld: bool,
    /// With --ten-sequences: only those whose names contain this
    #[arg(long, requires = "ten_sequences")]
    only: Option<String>,
    /// Folder for the results
    #[arg(long, default_value = "out/tracking")]
    out: PathBuf,
}

fn main() -> Result<(), AnyError> {
    let arguments = Arguments::parse();
    if arguments.ten_sequences {
        return ten_sequences::print_table(
            arguments.only.as_deref(),
            !arguments.no_depth,
            arguments.handheld,
        );
    }
    // The output folder is created first, so that an unwritable one is noticed before the run.
    std::fs::create_dir_all(&arguments.out)?;
    let runs = match (&arguments.dataset, &arguments.object) {
        (Some(dataset), Some(label)) => {
            vec![recorded_run::follow(dataset, label, arguments.map_until, !arguments.no_depth)?]
        }
        _ => vec![
            carried_run::follow(CarriedKind::Book, !arguments.no_depth)?,
            carried_run::follow(CarriedKind::Bottle, !arguments.no_depth)?,
        ],
    };
    let mut strip = Strip::default();
    for run in runs {
        run.print();
        write_results(run, &mut strip, &arguments)?;
    }
    let picture = strip.into_picture();
    let mut file = BufWriter::new(File::create(arguments.out.join(picture.name))?);
    picture.encode_png(&mut file)?;
    println!("written to {}", arguments.out.display());
    Ok(())
}

fn write_results(run: Followed, strip: &mut Strip, arguments: &Arguments) -> Result<(), AnyError> {
    let name = format!("poses_{}.txt", run.label.replace(' ', "_"));
    run.write_poses(&arguments.out.join(name))?;
    strip.add(run.panels);
    Ok(())
}

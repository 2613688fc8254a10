//! Detects things in the colour images of a recording, and writes them as `detections.jsonl`.
//!
//! `cargo run --release --manifest-path examples/detect/Cargo.toml -- --dataset DIR|FILE.mcap --model FILE.onnx [--names FILE]
//! [--out detections.jsonl] [--min-score 0.25] [--every N] [--compare FILE] [--picture FILE.png]`

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::{ArgGroup, Parser};
use dymlm::core::{ColorImage, Detection};
use dymlm_detect::{Comparison, ImageSource, Yolox, YoloxConfig, draw_boxes};
use dymlm_examples::{AnyError, Failure, Milliseconds, interruption, print_warning, progress_bar, timed};
use dymlm_io::{
    DetectionFile, encode_detections, read_class_names, read_color_image, write_atomically, write_png,
};

/// Detects things in the colour images of a recording by a YOLOX network, and writes them as detections.jsonl.
#[derive(Parser)]
#[command(group(ArgGroup::new("images").required(true).args(["dataset", "image"])))]
struct Arguments {
    /// TUM RGB-D folder, or a ROS 2 bag (FILE.mcap)
    #[arg(long)]
    dataset: Option<PathBuf>,
    /// One image, JPEG or PNG, whose detections are printed
    #[arg(long)]
    image: Option<PathBuf>,
    /// The network: YOLOX exported to ONNX
    #[arg(long)]
    model: PathBuf,
    /// Names of the network's classes, one a line; default: COCO's
    #[arg(long)]
    names: Option<PathBuf>,
    /// Where the detections are written
    #[arg(long, default_value = "out/detections.jsonl", conflicts_with = "image")]
    out: PathBuf,
    /// Least score of a detection, 0 to 1
    #[arg(long, default_value_t = YoloxConfig::default().min_score)]
    min_score: f32,
    /// Takes only every N-th frame
    #[arg(long, default_value_t = 1, conflicts_with = "image")]
    every: usize,
    /// Prints how much the detections differ from those of another detections.jsonl
    #[arg(long, conflicts_with = "image")]
    compare: Option<PathBuf>,
    /// Draws the boxes into the image, or into the recording's middle image
    #[arg(long)]
    picture: Option<PathBuf>,
}

fn main() -> Result<(), Failure> {
    let arguments = Arguments::parse();
    let yolox = open_network(&arguments)?;
    Ok(match (&arguments.image, &arguments.dataset) {
        (Some(path), _) => detect_in_image(path, &yolox, arguments.picture.as_deref()),
        (None, Some(dataset)) => detect_in_recording(dataset, &yolox, &arguments),
        (None, None) => Err("neither --dataset nor --image".into()),
    }?)
}

fn open_network(arguments: &Arguments) -> Result<Yolox, AnyError> {
    let mut config = YoloxConfig::default();
    config.min_score = arguments.min_score;
    if let Some(names) = &arguments.names {
        config.class_names = read_class_names(names)?;
    }
    Ok(Yolox::open(&arguments.model, config)?)
}

fn detect_in_image(path: &Path, yolox: &Yolox, picture: Option<&Path>) -> Result<(), AnyError> {
    let image = read_color_image(path)?;
    let found = yolox.detect(&image)?;
    for detection in &found {
        let [x_min, y_min, x_max, y_max] = <[f32; 4]>::from(detection.bounding_box());
        let (label, score) = (detection.label(), detection.score());
        println!("{label}: {score:.3}, [{x_min:.1}, {y_min:.1}, {x_max:.1}, {y_max:.1}]");
    }
    draw(picture, &image, &found)
}

fn draw(picture: Option<&Path>, image: &ColorImage, found: &[Detection]) -> Result<(), AnyError> {
    let Some(path) = picture else { return Ok(()) };
    let drawn = draw_boxes(image, found);
    Ok(write_png(path, drawn.width, drawn.height, &drawn.pixels)?)
}

fn detect_in_recording(dataset: &Path, yolox: &Yolox, arguments: &Arguments) -> Result<(), AnyError> {
    let mut images = ImageSource::open(dataset, arguments.every)?;
    let compare = |path| DetectionFile::open(path, DetectionFile::DEFAULT_TOLERANCE);
    let reference = arguments.compare.as_ref().map(compare).transpose()?;
    if let Some(folder) = arguments.out.parent() {
        fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    // The file is put in place when it is complete; an unwritable one is noticed before anything is detected.
    let mut run = Run::default();
    write_atomically(&arguments.out, |out| {
        detect_all(&mut images, yolox, arguments.picture.as_deref(), reference.as_ref(), out, &mut run)
    })?;
    run.print_summary();
    println!("written to {}", arguments.out.display());
    Ok(())
}

/// The results of a run.
#[derive(Default)]
struct Run {
    detections: usize,
    wall_ms: Vec<f64>,
    processor_ms: Vec<f64>,
    comparison: Option<Comparison>,
}

/// Writes a line for each image until the user interrupts. An image that cannot be read, or on which the
/// network fails, gives a warning and no line, since the detector did not run on it.
fn detect_all(
    images: &mut ImageSource,
    yolox: &Yolox,
    picture: Option<&Path>,
    reference: Option<&DetectionFile>,
    out: &mut dyn Write,
    run: &mut Run,
) -> Result<(), AnyError> {
    let interrupted = interruption("detections");
    let bar = progress_bar(images.len(), "detecting");
    let warn = |text: String| bar.suspend(|| print_warning(&text));
    images.warnings().into_iter().for_each(&warn);
    run.comparison = reference.map(|_| Comparison::default());
    let middle = images.len() / 2;
    for index in 0..images.len() {
        if interrupted.load(Ordering::Relaxed) {
            warn(format!("interrupted after {index} of {} frames", images.len()));
            break;
        }
        match detect_one(images, yolox, index, run) {
            Ok((timestamp, image, found)) => {
                encode_detections(out, timestamp, &found)?;
                run.compare(timestamp, &found, reference).unwrap_or_else(|error| warn(error.to_string()));
                if index == middle {
                    draw(picture, &image, &found).unwrap_or_else(|error| warn(error.to_string()));
                }
            }
            Err(error) => warn(format!("frame {index} skipped: {error}")),
        }
        bar.inc(1);
    }
    bar.finish();
    if run.wall_ms.is_empty() { Err("nothing was detected: no frame has an image".into()) } else { Ok(()) }
}

/// Time, image and detections of a frame.
fn detect_one(
    images: &mut ImageSource,
    yolox: &Yolox,
    index: usize,
    run: &mut Run,
) -> Result<(f64, ColorImage, Vec<Detection>), AnyError> {
    let timestamp = images.timestamp(index).ok_or("it has no time")?;
    let image = images.load(index)?.ok_or("it has no colour image")?;
    let (found, cost) = timed(|| yolox.detect(&image));
    let found = found?;
    run.wall_ms.push(cost.wall_ms);
    run.processor_ms.push(cost.cpu_ms);
    run.detections += found.len();
    Ok((timestamp, image, found))
}

impl Run {
    /// Compares with the reference's line for the image, if it has one.
    fn compare(
        &mut self,
        timestamp: f64,
        found: &[Detection],
        reference: Option<&DetectionFile>,
    ) -> Result<(), AnyError> {
        let reference = reference.map(|file| file.at(timestamp)).transpose()?.flatten();
        if let (Some(comparison), Some(reference)) = (&mut self.comparison, reference) {
            comparison.add(found, &reference);
        }
        Ok(())
    }

    fn print_summary(self) {
        let frames = self.wall_ms.len();
        let [wall, processor] = [self.wall_ms, self.processor_ms].map(Milliseconds::of);
        println!("{} detections in {frames} frames", self.detections);
        println!(
            "median {:.1} ms a frame, 95 % within {:.1} ms, {:.1} ms at most; processor: {:.1}, {:.1}, {:.1} ms",
            wall.median_ms, wall.p95_ms, wall.max_ms, processor.median_ms, processor.p95_ms, processor.max_ms
        );
        if let Some(comparison) = self.comparison {
            println!("compared: {comparison}");
        }
    }
}

//! The cost of a frame and the size of the maps as a map grows: a floor of 60 rooms, an aisle of 1 km, an
//! hour at rest. For each stage, the key frames 100 to 200 are compared with the last 100.
//!
//! `cargo run --release -p dymlm-benches --bin growth -- [building] [aisle] [standing] [1/N]`: `1/10` takes
//! the first tenth of the frames. Images are small (160x120, at rest 80x60) to make frames cheap: times
//! should be compared with each other, not with those of a real camera.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use std::collections::VecDeque;
use std::error::Error;
use std::time::Duration;

use dymlm::{FrameOutcome, MapBuilder, MapConfig, MultiLevelMap, Stage, StageTimes};
use dymlm_benches::kinect_of_width;
use dymlm_core::{BoundingBox, Detection, Frame, Pose};
use dymlm_sim::{Activity, CameraPath, FrameScratch, Sequence, SequenceConfig};
use dymlm_test_support::processor_time;
use dymlm_test_support::{Cuboid, Rectangle, World, look_at};

type AnyError = Box<dyn Error>;

/// A frame with its detections and its pose.
type Input = (Frame, Vec<Detection>, Pose);

/// The cost of a key frame.
#[derive(Clone, Copy)]
struct Cost {
    stages: StageTimes,
    /// Processor time of the whole insertion.
    processor: Duration,
}

/// Number of key frames that are compared.
const WINDOW: usize = 100;

fn main() -> Result<(), AnyError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let part: usize = match arguments.iter().find_map(|argument| argument.strip_prefix("1/")) {
        Some(part) => part.parse()?,
        None => 1,
    };
    let asked = |name: &str| {
        let named = arguments.iter().filter(|argument| !argument.starts_with("1/"));
        named.clone().count() == 0 || named.into_iter().any(|argument| argument == name)
    };
    if asked("building") {
        let mut config = SequenceConfig::building(1, 60);
        config.frames = config.frames * 22 / 100;
        config.frame_rate *= 0.22;
        config.camera = Some(kinect_of_width(160)?);
        grow("60 rooms", sequence(&config)?, config.frames / part)?;
    }
    if asked("aisle") {
        grow("aisle of 1 km", aisle, AISLE_FRAMES / part)?;
    }
    if asked("standing") {
        let mut config = SequenceConfig::default();
        (config.path, config.activity) = (CameraPath::Static, Activity::Sitting);
        (config.frames, config.frame_rate) = (108_000, 30.0);
        config.camera = Some(kinect_of_width(80)?);
        grow("an hour at rest", sequence(&config)?, config.frames / part)?;
    }
    Ok(())
}

fn sequence(config: &SequenceConfig) -> Result<impl FnMut(usize) -> Result<Input, AnyError>, AnyError> {
    let sequence = Sequence::new(config)?;
    let mut scratch = FrameScratch::default();
    Ok(move |index| {
        let frame = sequence.frame_with(index, &mut scratch).ok_or("the sequence has ended")?;
        let input = (frame.frame.clone(), frame.detections.clone(), frame.estimated_world_from_camera);
        scratch.recycle(frame);
        Ok(input)
    })
}

/// Number of frames of the aisle, distance between two frames in metres, and frames per second.
const AISLE_FRAMES: usize = 5000;
const STEP: f64 = 0.2;
const RATE: f64 = 5.0;
/// Distance between boxes on the same side, metres.
const APART: f64 = 4.0;

/// An aisle of 2.4 m between walls, with a box every two metres.
fn aisle(index: usize) -> Result<Input, AnyError> {
    let x = STEP * index as f64;
    let camera = kinect_of_width(160)?;
    let world_from_camera = look_at([x, 0.0, 1.3], [x + 2.0, 0.6 * (0.31 * index as f64 / RATE).sin(), 0.8]);
    let mut world = World::of(&[
        Rectangle::level([x + 3.0, 0.0, 0.0], 8.0, 1.2),
        Rectangle::upright([x + 3.0, -1.2, 1.3], 8.0, 1.3),
        Rectangle::upright([x + 3.0, 1.2, 1.3], 8.0, 1.3),
    ]);
    let nearest = (x / APART).floor();
    for k in 0..3 {
        for (side, shift) in [(-1.0, 0.0), (1.0, 0.5)] {
            let at = [(nearest + f64::from(k) + shift) * APART, side * 0.95, 0.2];
            world.cuboids.push(Cuboid {
                world_from_cuboid: Pose::new(at, [0.0, 0.0, 0.0, 1.0])?,
                lengths: [0.6, 0.35, 0.4],
            });
        }
    }
    let mut bounds = vec![[usize::MAX, usize::MAX, 0, 0]; world.cuboids.len()];
    for (pixel, hit) in world.view(&camera, &world_from_camera).into_iter().enumerate() {
        if let Some(cuboid) = hit.and_then(|hit| hit.cuboid) {
            let (u, v) = (pixel % camera.width(), pixel / camera.width());
            let [left, top, right, bottom] = bounds[cuboid];
            bounds[cuboid] = [left.min(u), top.min(v), right.max(u + 1), bottom.max(v + 1)];
        }
    }
    let found =
        bounds.into_iter().filter(|[left, top, right, bottom]| right > &(left + 4) && bottom > &(top + 4));
    let detections = found.map(|sides| {
        let [left, top, right, bottom] = sides.map(|side| side as f32);
        Detection::new("suitcase", 0.9, BoundingBox::new(left, top, right, bottom)?)
    });
    let detections = detections.collect::<Result<Vec<_>, _>>()?;
    let (depth, color) = world.frame(camera, &world_from_camera, index as u64).into_images();
    Ok((Frame::new(index as f64 / RATE, camera, depth, color)?, detections, world_from_camera))
}

/// Maps the frames and prints their cost.
fn grow(
    name: &str,
    mut input: impl FnMut(usize) -> Result<Input, AnyError>,
    frames: usize,
) -> Result<(), AnyError> {
    let mut builder = MapBuilder::new(MapConfig::default())?;
    let (mut early, mut late) = (Vec::new(), VecDeque::<Cost>::new());
    let mut key_frames = 0;
    println!("{name}: {frames} frames\n{MEMORY_HEADING}");
    for index in 0..frames {
        let (frame, detections, world_from_camera) = input(index)?;
        let start = processor_time();
        let report = builder.insert(&frame, &detections, &world_from_camera)?;
        let cost = Cost { stages: report.stages, processor: processor_time().saturating_sub(start) };
        if matches!(report.outcome, FrameOutcome::Mapped(_)) {
            if (WINDOW..2 * WINDOW).contains(&key_frames) {
                early.push(cost);
            }
            late.push_back(cost);
            key_frames += 1;
            late.drain(..late.len().saturating_sub(WINDOW));
        }
        if index + 1 == 2 * WINDOW || (index + 1).is_multiple_of((frames / 5).max(1)) {
            print_memory([index + 1, key_frames], builder.map());
        }
    }
    println!("{:16} {:>22} {:>22} {:>8}", "ms a frame", "100 to 200: median", "last 100: median", "ratio");
    let late = late.make_contiguous();
    for &stage in Stage::ALL {
        print_times(stage.name(), [&early, late], |cost| cost.stages.of(stage).as_secs_f64());
    }
    print_times("insert", [&early, late], |cost| cost.stages.total().as_secs_f64());
    // Processor time hardly depends on other programs on the machine.
    print_times("processor time", [&early, late], |cost| cost.processor.as_secs_f64());
    println!();
    Ok(())
}

const MEMORY_HEADING: &str =
    " frames  key frames  cloud MB  octree MB  planes MB  objects MB    voxels  planes  objects";

fn print_memory([frames, key_frames]: [usize; 2], map: &MultiLevelMap) {
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    let memory = map.memory();
    println!(
        "{frames:7} {key_frames:11} {:9.2} {:10.2} {:10.2} {:11.2} {:9} {:7} {:8}",
        megabytes(memory.cloud),
        megabytes(memory.octree),
        megabytes(memory.planes),
        megabytes(memory.objects),
        map.cloud().held_voxels(),
        map.planes().iter().count(),
        map.objects().objects().count(),
    );
}

/// Median and mean of both windows, and the ratio of the means: work done once a second shows in no median.
fn print_times(name: &str, windows: [&[Cost]; 2], time: impl Fn(&Cost) -> f64) {
    let [early, late] = windows.map(|frames| {
        let mut times: Vec<f64> = frames.iter().map(|cost| 1e3 * time(cost)).collect();
        times.sort_by(f64::total_cmp);
        let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
        (times.get(times.len() / 2).copied().unwrap_or(0.0), mean)
    });
    let text = |(median, mean): (f64, f64)| format!("{median:.3} (mean {mean:.3})");
    println!("{name:16} {:>22} {:>22} {:8.2}", text(early), text(late), late.1 / early.1);
}

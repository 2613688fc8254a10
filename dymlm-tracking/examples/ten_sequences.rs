//! Follows ten things that a hand carries through the rendered office, and prints how far from the truth.
//!
//! `cargo run --release -p dymlm-tracking --example ten_sequences [-- no-depth] [-- handheld] [-- NAME]`

#![allow(clippy::print_stdout, reason = "an example")]

use std::error::Error;
use std::time::Instant;

use dymlm_core::{DepthImage, Frame, Pose};
use dymlm_sim::{
    CameraPath, CarriedKind, CarriedMotion, CarriedObject, CarriedThing, Sequence, SequenceConfig,
    SimulatedFrame,
};
use dymlm_tracking::{ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig};

const SEQUENCES: [(&str, CarriedKind, CarriedMotion); 10] = [
    ("book tilted", CarriedKind::Book, CarriedMotion::RotationX),
    ("book moved", CarriedKind::Book, CarriedMotion::Translation),
    ("book covered", CarriedKind::Book, CarriedMotion::Occlusion),
    ("keyboard tilted", CarriedKind::Keyboard, CarriedMotion::RotationX),
    ("keyboard turned", CarriedKind::Keyboard, CarriedMotion::RotationZ),
    ("bottle leant", CarriedKind::Bottle, CarriedMotion::RotationY),
    ("bottle shaken", CarriedKind::Bottle, CarriedMotion::Fast),
    ("cup moved", CarriedKind::Cup, CarriedMotion::Translation),
    ("box turned", CarriedKind::Box, CarriedMotion::RotationZ),
    ("box shaken", CarriedKind::Box, CarriedMotion::Fast),
];

/// What a sequence came to.
#[derive(Default)]
struct Figures {
    distances: Vec<f64>,
    angles: Vec<f64>,
    milliseconds: Vec<f64>,
    frames_without: usize,
    longest_without: usize,
    losses: usize,
    rests: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let has = |word: &str| words.iter().any(|w| w == word);
    let names: Vec<&String> =
        words.iter().filter(|w| !["no-depth", "handheld"].contains(&w.as_str())).collect();
    println!(
        "sequence         | distance cm: median  95 %   max | angle deg: median  95 % | without pose: frames  longest s | lost | rests | ms: median  95 %"
    );
    for (name, kind, motion) in SEQUENCES {
        if !names.is_empty() && !names.iter().any(|n| name.starts_with(n.as_str())) {
            continue;
        }
        let mut config = SequenceConfig::default();
        config.people = 0;
        config.frame_rate = 30.0;
        config.frames = 270;
        config.path = if has("handheld") { CameraPath::Handheld } else { CameraPath::Xyz };
        config.carried = Some(CarriedObject::new(kind, motion));
        let f = follow(&Sequence::new(&config)?, kind, !has("no-depth"))?;
        let [d, a, t] = [f.distances, f.angles, f.milliseconds].map(Sorted::new);
        println!(
            "{name:<16} | {:>19.2} {:>5.2} {:>5.2} | {:>17.2} {:>5.2} | {:>20} {:>10.1} | {:>4} | {:>5} | {:>10.1} {:>5.1}",
            d.at(0.5),
            d.at(0.95),
            d.at(1.0),
            a.at(0.5),
            a.at(0.95),
            f.frames_without,
            f.longest_without as f64 / 30.0,
            f.losses,
            f.rests,
            t.at(0.5),
            t.at(0.95),
        );
    }
    Ok(())
}

fn follow(sequence: &Sequence, kind: CarriedKind, has_depth: bool) -> Result<Figures, Box<dyn Error>> {
    let mut frames = sequence.frames();
    let first = frames.next().ok_or("a sequence has a frame")?;
    let thing = first.carried.ok_or("nothing is carried")?;
    let mut tracker = ObjectTracker::new(
        &seen(&first, has_depth)?,
        &first.world_from_camera,
        model(&thing, kind)?,
        Some(thing.label),
        &thing.world_from_object,
        &ObjectTrackerConfig::default(),
    )?;
    let mut figures = Figures::default();
    let (mut without, mut was_lost) = (0, false);
    for frame in frames {
        let truth = frame.carried.ok_or("nothing is carried")?.world_from_object;
        let input = seen(&frame, has_depth)?;
        let begin = Instant::now();
        let update = tracker.track(&input, &frame.detections, &frame.world_from_camera)?;
        figures.milliseconds.push(1e3 * begin.elapsed().as_secs_f64());
        if update.inliers > 0 {
            figures.distances.push(100.0 * update.world_from_object.distance(&truth));
            figures.angles.push(angle(kind, &update.world_from_object, &truth).to_degrees());
            without = 0;
        } else {
            figures.frames_without += 1;
            without += 1;
            figures.longest_without = figures.longest_without.max(without);
        }
        let is_lost = update.state == ObjectState::Lost;
        figures.losses += usize::from(is_lost && !was_lost);
        was_lost = is_lost;
        figures.rests += usize::from(update.came_to_rest.is_some());
    }
    Ok(figures)
}

/// The frame, or the frame without its depth.
fn seen(frame: &SimulatedFrame, has_depth: bool) -> Result<Frame, Box<dyn Error>> {
    if has_depth {
        return Ok(frame.frame.clone());
    }
    let camera = frame.frame.camera();
    let blank = vec![0.0; camera.width() * camera.height()];
    let depth = DepthImage::new(camera.width(), camera.height(), blank)?;
    Ok(Frame::new(frame.frame.timestamp(), *camera, depth, frame.frame.color().cloned())?)
}

/// The thing's surface as a map would know it: a cuboid, or the cloud of a cylinder.
fn model(thing: &CarriedThing, kind: CarriedKind) -> Result<ObjectModel, Box<dyn Error>> {
    if !is_round(kind) {
        return Ok(ObjectModel::cuboid(thing.lengths)?);
    }
    let [width, depth, height] = thing.lengths;
    let points = (0..4320_u32).map(|i| {
        let (sin, cos) = (f64::from(i % 72) * std::f64::consts::TAU / 72.0).sin_cos();
        let up = (f64::from(i / 72) + 0.5) / 60.0 - 0.5;
        [0.5 * width * cos, 0.5 * depth * sin, height * up].map(|x| x as f32)
    });
    Ok(ObjectModel::from_points(&points.collect::<Vec<_>>())?)
}

fn is_round(kind: CarriedKind) -> bool {
    matches!(kind, CarriedKind::Bottle | CarriedKind::Cup)
}

/// The angle between two poses; of round things that between their axes.
fn angle(kind: CarriedKind, a: &Pose, b: &Pose) -> f64 {
    if !is_round(kind) {
        return a.angle(b);
    }
    let [a, b] = [a, b].map(|pose| pose.rotate([0.0, 0.0, 1.0]));
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>().clamp(-1.0, 1.0).acos()
}

struct Sorted(Vec<f64>);

impl Sorted {
    fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self(values)
    }

    fn at(&self, share: f64) -> f64 {
        let last = self.0.len().saturating_sub(1) as f64;
        self.0.get((last * share) as usize).copied().unwrap_or(f64::NAN)
    }
}

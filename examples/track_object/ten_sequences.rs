use std::time::Instant;

use dymlm::core::Point;
use dymlm::tracking::{ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig};
use dymlm_examples::AnyError;
use dymlm_sim::{
    CameraPath, CarriedKind, CarriedMotion, CarriedObject, CarriedThing, Sequence, SequenceConfig,
};

use crate::errors::{Errors, Quantiles, is_round};
use crate::follow::seen;

/// Ten things that a hand carries through the rendered office.
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

/// Frames a second.
const RATE: f64 = 30.0;
const FRAMES: usize = 270;

/// What a sequence came to.
#[derive(Default)]
struct Figures {
    errors: Errors,
    milliseconds: Vec<f64>,
    frames_without: usize,
    longest_without: usize,
    losses: usize,
    rests: usize,
}

/// Follows each with the exact model of its surface and its exact pose in the first frame, and prints how far from the
/// truth.
#[allow(clippy::print_stdout, reason = "a program for the terminal")]
pub(crate) fn print_table(only: Option<&str>, has_depth: bool, handheld: bool) -> Result<(), AnyError> {
    println!(
        "sequence         | distance cm: median  95 %   max | angle deg: median  95 % | without pose: frames  longest s | lost | rests | ms: median  95 %"
    );
    let chosen = SEQUENCES.iter().filter(|(name, ..)| only.is_none_or(|only| name.contains(only)));
    for &(name, kind, motion) in chosen {
        let mut config = SequenceConfig::default();
        config.people = 0;
        config.frame_rate = RATE;
        config.frames = FRAMES;
        config.path = if handheld { CameraPath::Handheld } else { CameraPath::Xyz };
        config.carried = Some(CarriedObject::new(kind, motion));
        let f = follow(&Sequence::new(&config)?, kind, has_depth)?;
        let [d, a, t] = [f.errors.distances, f.errors.angles, f.milliseconds].map(Quantiles::of);
        println!(
            "{name:<16} | {:>19.2} {:>5.2} {:>5.2} | {:>17.2} {:>5.2} | {:>20} {:>10.1} | {:>4} | {:>5} | {:>10.1} {:>5.1}",
            d.at(0.5),
            d.at(0.95),
            d.at(1.0),
            a.at(0.5),
            a.at(0.95),
            f.frames_without,
            f.longest_without as f64 / RATE,
            f.losses,
            f.rests,
            t.at(0.5),
            t.at(0.95),
        );
    }
    Ok(())
}

fn follow(sequence: &Sequence, kind: CarriedKind, has_depth: bool) -> Result<Figures, AnyError> {
    let mut frames = sequence.frames();
    let first = frames.next().ok_or("a sequence has a frame")?;
    let thing = first.carried.ok_or("nothing is carried")?;
    let mut tracker = ObjectTracker::new(
        &seen(&first.frame, has_depth)?,
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
        let input = seen(&frame.frame, has_depth)?;
        let begin = Instant::now();
        let update = tracker.track(&input, &frame.detections, &frame.world_from_camera)?;
        figures.milliseconds.push(1e3 * begin.elapsed().as_secs_f64());
        if update.inliers > 0 {
            figures.errors.add(kind, &update.world_from_object, &truth);
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

/// The thing's surface as a map would know it: a cuboid, or the cloud of a cylinder.
fn model(thing: &CarriedThing, kind: CarriedKind) -> Result<ObjectModel, AnyError> {
    if !is_round(kind) {
        return Ok(ObjectModel::cuboid(thing.lengths)?);
    }
    let [width, depth, height] = thing.lengths;
    let points = (0..4320_u32).map(|i| {
        let (sin, cos) = (f64::from(i % 72) * std::f64::consts::TAU / 72.0).sin_cos();
        let up = (f64::from(i / 72) + 0.5) / 60.0 - 0.5;
        [0.5 * width * cos, 0.5 * depth * sin, height * up].map(|x| x as f32)
    });
    Ok(ObjectModel::from_points(&points.collect::<Vec<Point>>())?)
}

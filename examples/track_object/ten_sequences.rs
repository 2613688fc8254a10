use std::fmt;
use std::time::Instant;

use dymlm::core::{Point, SensorModel};
use dymlm::tracking::{ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig};
use dymlm_examples::AnyError;
use dymlm_sim::{CameraPath, CarriedKind, CarriedObject, CarriedThing, Sequence, SequenceConfig};

use crate::errors::{Errors, Quantiles, is_round};
use crate::follow::seen;
use crate::visibility::{IN_VIEW, visible_share};

/// Frames a second.
const RATE: f64 = 30.0;
const FRAMES: usize = 270;

/// The limits for each sequence.
struct Bounds {
    /// Limits of the median errors, centimetres and degrees.
    distance: f64,
    angle: f64,
}

const WITH_DEPTH: Bounds = Bounds { distance: 1.0, angle: 3.0 };
const WITHOUT_DEPTH: Bounds = Bounds { distance: 2.5, angle: 5.0 };
/// A pose that is off by more than this many times a median's bound is wrong.
const WRONG: f64 = 4.0;
const MOST_LOSSES: usize = 1;
/// Longest time in view without a right pose, seconds.
const LONGEST: f64 = 1.0;

/// The results of a sequence.
#[derive(Default)]
struct Figures {
    errors: Errors,
    milliseconds: Vec<f64>,
    /// Number of frames that show less of the thing than [`IN_VIEW`].
    covered: usize,
    /// Number of frames in view without a right pose, and the longest run of them.
    missing: usize,
    longest: usize,
    losses: usize,
    rests: usize,
}

impl Figures {
    /// The figures that exceed their bounds.
    fn faults(&self, bounds: &Bounds) -> Vec<String> {
        let [distance, angle] =
            [&self.errors.distances, &self.errors.angles].map(|values| Quantiles::of(values.clone()).at(0.5));
        let longest = self.longest as f64 / RATE;
        // Without poses there is no median either.
        let checks = [
            (distance <= bounds.distance, format!("median of {distance:.2} cm")),
            (angle <= bounds.angle, format!("median of {angle:.2} deg")),
            (self.losses <= MOST_LOSSES, format!("lost {} times", self.losses)),
            (longest <= LONGEST, format!("{longest:.1} s in view without a right pose")),
            (self.rests == 1, format!("{} places of rest", self.rests)),
        ];
        checks.into_iter().filter(|(is_kept, _)| !is_kept).map(|(_, fault)| fault).collect()
    }
}

/// Follows each of the ten things with the exact model of its surface and its exact pose in the first frame,
/// and prints the errors.
///
/// # Errors
///
/// When a sequence exceeds its bounds.
#[allow(clippy::print_stdout, reason = "a program for the terminal")]
pub(crate) fn print_table(only: Option<&str>, has_depth: bool, handheld: bool) -> Result<(), AnyError> {
    let bounds = if has_depth { WITH_DEPTH } else { WITHOUT_DEPTH };
    println!(
        "A thing is in view where a third of its outline shows it. A pose off by more than {:.0} cm or {:.0} deg is wrong. \
         A thing that was covered\nor lost is found again within the longest time in view without a right pose.\n",
        WRONG * bounds.distance,
        WRONG * bounds.angle
    );
    println!(
        "sequence         | distance cm: median  95 %   max | angle deg: median  95 % | covered frames | in view without a \
         right pose: frames  longest s | lost | rests | ms: median  95 %"
    );
    let mut faults = Vec::new();
    let is_chosen = |name: &String| only.is_none_or(|only| name.contains(only));
    let chosen: Vec<_> =
        CarriedObject::ten().into_iter().map(|carried| (carried.to_string(), carried)).collect();
    if !chosen.iter().any(|(name, _)| is_chosen(name)) {
        return Err("no sequence has such a name".into());
    }
    for (name, carried) in chosen.into_iter().filter(|(name, _)| is_chosen(name)) {
        let mut config = SequenceConfig::default();
        config.people = 0;
        config.frame_rate = RATE;
        config.frames = FRAMES;
        config.path = if handheld { CameraPath::Handheld } else { CameraPath::Xyz };
        config.carried = Some(carried);
        let figures = follow(&Sequence::new(&config)?, carried.kind, has_depth, &bounds)?;
        println!("{name:<16} | {figures}");
        faults.extend(figures.faults(&bounds).into_iter().map(|fault| format!("{name}: {fault}")));
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("; ").into()) }
}

impl fmt::Display for Figures {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Errors { distances, angles } = &self.errors;
        let [d, a, t] = [distances, angles, &self.milliseconds].map(|values| Quantiles::of(values.clone()));
        write!(
            out,
            "{:>19.2} {:>5.2} {:>5.2} | {:>17.2} {:>5.2} | {:>14} | {:>42} {:>10.1} | {:>4} | {:>5} | {:>10.1} {:>5.1}",
            d.at(0.5),
            d.at(0.95),
            d.at(1.0),
            a.at(0.5),
            a.at(0.95),
            self.covered,
            self.missing,
            self.longest as f64 / RATE,
            self.losses,
            self.rests,
            t.at(0.5),
            t.at(0.95)
        )
    }
}

fn follow(
    sequence: &Sequence,
    kind: CarriedKind,
    has_depth: bool,
    bounds: &Bounds,
) -> Result<Figures, AnyError> {
    let mut frames = sequence.frames();
    let first = frames.next().ok_or("a sequence has a frame")?;
    let thing = first.carried.ok_or("nothing is carried")?;
    let mut tracker = ObjectTracker::new(
        &seen(&first.frame, has_depth)?,
        &first.world_from_camera,
        model(&thing, kind)?,
        Some(thing.label),
        &thing.world_from_object,
        SensorModel::kinect(),
        &ObjectTrackerConfig::default(),
    )?;
    let mut figures = Figures::default();
    let (mut missing, mut was_lost) = (0, false);
    for frame in frames {
        let truth = frame.carried.ok_or("nothing is carried")?.world_from_object;
        let input = seen(&frame.frame, has_depth)?;
        let begin = Instant::now();
        let update = tracker.track(&input, &frame.detections, &frame.world_from_camera)?;
        figures.milliseconds.push(1e3 * begin.elapsed().as_secs_f64());

        let mut is_right = false;
        if update.inliers > 0 {
            let [distance, angle] = figures.errors.add(kind, &update.world_from_object, &truth);
            is_right = distance <= WRONG * bounds.distance && angle <= WRONG * bounds.angle;
        }
        let is_in_view = visible_share(&frame, tracker.model()).is_some_and(|share| share >= IN_VIEW);
        figures.covered += usize::from(!is_in_view);
        if is_right {
            missing = 0;
        } else if is_in_view {
            // Frames in which the thing is occluded neither count nor end a run.
            missing += 1;
            figures.missing += 1;
            figures.longest = figures.longest.max(missing);
        }
        let is_lost = update.state == ObjectState::Lost;
        figures.losses += usize::from(is_lost && !was_lost);
        was_lost = is_lost;
        figures.rests += usize::from(update.came_to_rest.is_some());
    }
    Ok(figures)
}

/// The thing's surface as a map would have it: a cuboid, or the points of a cylinder.
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

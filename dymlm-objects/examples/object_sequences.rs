//! Maps the objects of the eight simulated sequences and of random rooms, and scores them; with `--ablation` also with parts
//! left out.
//!
//! ```text
//! cargo run --release -p dymlm-objects --example object_sequences -- [--ablation] [--per-object] [--sparse] [NAME ...]
//! ```
//!
//! Names are those of the eight (`walking_xyz` ...) and `random_room_0`, `random_room_1` ...; without any it is the eight.
//! `--sparse` takes every third frame.
//!
//! `ms/frame` is the median of the object step's processor time. Masks come from `dymlm-dynamics`, planes from `dymlm-planes`, as in `MapBuilder`. Every variant sees the same frames.

#![allow(clippy::print_stdout, reason = "an application")]

use std::error::Error;
use std::time::Duration;

use dymlm_core::SensorModel;
use dymlm_dynamics::{DynamicsConfig, Preprocessor};
use dymlm_metrics::{EstimatedObject, ObjectScore, TrueObject, score_objects};
use dymlm_objects::Switch::{Off, On};
use dymlm_objects::{
    CentroidTest, MapObject, ObjectConfig, ObjectMapper, ObjectState, ObjectView, SupportPlane, Switch,
};
use dymlm_planes::{PlaneConfig, PlaneMapper};
use dymlm_sim::{FrameScratch, Sequence, SequenceConfig, SequenceType, Truth, TruthConfig};
use rustix::time::{ClockId, clock_gettime};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| args.iter().any(|arg| arg == flag);
    let names: Vec<&str> = args.iter().map(String::as_str).filter(|arg| !arg.starts_with("--")).collect();
    let every = if has("--sparse") { 3 } else { 1 };
    let variants = if has("--ablation") { ablation() } else { vec![Variant::new("all", |_| {})] };

    let mut totals = vec![Total::default(); variants.len()];
    for (name, config) in sequences(&names, every) {
        let sequence = Sequence::new(&config)?;
        let runs = map_objects(&sequence, &variants)?;
        println!("\n{name}");
        println!("  {HEADER}");
        for ((variant, run), total) in variants.iter().zip(&runs).zip(&mut totals) {
            println!("  {:34} {}", variant.name, row(run));
            total.add(run);
            if has("--per-object") {
                print_objects(run);
            }
        }
    }
    println!("\nall sequences\n  {HEADER}");
    for (variant, total) in variants.iter().zip(&totals) {
        println!("  {:34} {}", variant.name, total.row());
    }
    Ok(())
}

/// The sequences of some names, every so many frames; of none, the eight.
fn sequences(names: &[&str], every: usize) -> Vec<(String, SequenceConfig)> {
    let eight = SequenceType::ALL.iter().map(|kind| (kind.name().to_owned(), kind.config()));
    let chosen = eight.filter(|(name, _)| names.is_empty() || names.contains(&name.as_str()));
    let rooms = names.iter().filter_map(|name| {
        let seed: u64 = name.strip_prefix("random_room_")?.parse().ok()?;
        let mut config = SequenceConfig::random_room(seed);
        config.frames = RANDOM_ROOM_FRAMES;
        Some(((*name).to_owned(), config))
    });
    let thinned = |(name, mut config): (String, SequenceConfig)| {
        config.frames = config.frames.div_ceil(every);
        config.frame_rate /= every as f64;
        (name, config)
    };
    chosen.chain(rooms).map(thinned).collect()
}

/// Frames of a random room: one round of the camera's path.
const RANDOM_ROOM_FRAMES: usize = 80;

const HEADER: &str = "                                   recall  precision  duplicates  mean IoU  median centre  label  ms/frame";

/// A config with something left out.
struct Variant {
    name: &'static str,
    config: ObjectConfig,
}

impl Variant {
    fn new(name: &'static str, change: impl FnOnce(&mut ObjectConfig)) -> Self {
        let mut config = ObjectConfig::default();
        change(&mut config);
        Self { name, config }
    }
}

fn ablation() -> Vec<Variant> {
    let only = |config: &mut ObjectConfig, [projection, motion, shared, centroid]: [Switch; 4]| {
        let association = &mut config.association;
        association.projection = projection;
        association.motion = motion;
        association.shared = shared;
        association.centroid = centroid;
    };
    vec![
        Variant::new("all", |_| {}),
        Variant::new("association: projection IoU only", |config| only(config, [On, Off, Off, Off])),
        Variant::new("association: motion IoU only", |config| only(config, [Off, On, Off, Off])),
        Variant::new("association: shared points only", |config| only(config, [Off, Off, On, Off])),
        Variant::new("association: centroid only", |config| only(config, [Off, Off, Off, On])),
        Variant::new("association: paper's t-test only", |config| {
            only(config, [Off, Off, Off, On]);
            config.association.centroid_test = CentroidTest::OneSampleT;
        }),
        Variant::new("association: with the paper's t-test", |config| {
            config.association.centroid_test = CentroidTest::OneSampleT;
        }),
        Variant::new("parameters: PCA alone", |config| {
            config.parameterization.support = Off;
            config.parameterization.fitter.rectangle = Off;
            config.update.edges = Off;
            config.update.completion = Off;
        }),
        Variant::new("parameters: PCA, rectangle", |config| {
            config.parameterization.support = Off;
            config.update.edges = Off;
            config.update.completion = Off;
        }),
        Variant::new("parameters: PCA, rectangle, support", |config| {
            config.update.edges = Off;
            config.update.completion = Off;
        }),
        Variant::new("parameters: without completion", |config| config.update.completion = Off),
        Variant::new("parameters: without edges", |config| config.update.edges = Off),
        Variant::new("parameters: without rectangle", |config| {
            config.parameterization.fitter.rectangle = Off;
        }),
        Variant::new("update: without isolation forest", |config| config.update.forest = Off),
    ]
}

/// What a variant made of a sequence.
struct Run {
    objects: Vec<MapObject>,
    /// All that was ever in the map and was not believed at the end.
    doubted: Vec<MapObject>,
    truth: Vec<TrueObject>,
    score: ObjectScore,
    milliseconds: Vec<f64>,
}

fn map_objects(sequence: &Sequence, variants: &[Variant]) -> Result<Vec<Run>, Box<dyn Error>> {
    let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect())?;
    let mover_labels = preprocessor.mover_labels().to_vec();
    let mut planes = PlaneMapper::new(PlaneConfig::default(), &SensorModel::kinect())?;
    let mut truth = Truth::new(sequence, &TruthConfig::default())?;
    let mut mappers: Vec<ObjectMapper> =
        variants.iter().map(|variant| ObjectMapper::new(variant.config.clone())).collect::<Result<_, _>>()?;
    let mut times = vec![Vec::new(); variants.len()];
    let mut scratch = FrameScratch::default();
    for index in 0..sequence.len() {
        let Some(simulated) = sequence.frame_with(index, &mut scratch) else { break };
        truth.observe(&simulated);
        let pose = simulated.estimated_world_from_camera;
        let mask =
            preprocessor.process(&simulated.frame, Some(&simulated.detections), &pose, &[])?.static_mask;
        planes.insert(&simulated.frame, Some(mask), &[], &pose)?;
        let view = ObjectView::new(&simulated.frame, &simulated.detections, &pose)
            .with_static_mask(mask)?
            .without_labels(&mover_labels);
        let near = |point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>| {
            let near = planes.map().supports_near(point, reach);
            found.extend(near.map(|plane| SupportPlane::new(plane.id().get(), plane.plane())));
        };
        for (mapper, times) in mappers.iter_mut().zip(&mut times) {
            let start = processor_time();
            mapper.observe(&view, &near)?;
            times.push(1e3 * processor_time().saturating_sub(start).as_secs_f64());
        }
        scratch.recycle(simulated);
    }
    let truth = truth.objects();
    let run = |(mapper, mut milliseconds): (ObjectMapper, Vec<f64>)| {
        milliseconds.sort_unstable_by(f64::total_cmp);
        let objects: Vec<MapObject> = mapper.map().objects().cloned().collect();
        let all = mapper.map().all_objects().iter();
        let doubted = all.filter(|object| object.state() == ObjectState::Tentative).cloned().collect();
        let estimates: Vec<EstimatedObject> = objects.iter().map(estimate).collect();
        let score = score_objects(&estimates, &truth);
        Ok(Run { objects, doubted, truth: truth.clone(), score, milliseconds })
    };
    mappers.into_iter().zip(times).map(run).collect()
}

/// Of this process, which has one thread: other programs on the machine hardly change it.
fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

fn estimate(object: &MapObject) -> EstimatedObject {
    EstimatedObject {
        label: object.label().to_owned(),
        world_from_object: object.oriented_box().world_from_box(),
        dimensions: object.oriented_box().lengths(),
    }
}

fn row(run: &Run) -> String {
    let mut total = Total::default();
    total.add(run);
    total.row()
}

/// Scores added up over sequences.
#[derive(Clone, Default)]
struct Total {
    found: usize,
    asked: usize,
    matches: usize,
    estimates: usize,
    duplicates: usize,
    right: f64,
    iou: Vec<f64>,
    centers: Vec<f64>,
    milliseconds: Vec<f64>,
}

impl Total {
    fn add(&mut self, run: &Run) {
        let score = &run.score;
        self.asked += score.asked;
        self.found += score.asked - score.missed.len();
        self.matches += score.matches.len();
        self.estimates += score.estimates;
        self.duplicates += score.duplicates.len();
        self.right += score.label_accuracy().unwrap_or(0.0) * score.matches.len() as f64;
        self.iou.extend(score.matches.iter().map(|found| found.iou));
        self.centers.extend(score.matches.iter().map(|found| found.center_error));
        self.milliseconds.extend_from_slice(&run.milliseconds);
    }

    fn row(&self) -> String {
        let percent = |part: f64, whole: usize| 100.0 * part / whole.max(1) as f64;
        format!(
            "{:5.1} %    {:5.1} %  {:10}  {:8.3}  {:10.1} cm  {:3.0} %  {:8.1}",
            percent(self.found as f64, self.asked),
            percent(self.matches as f64, self.estimates),
            self.duplicates,
            self.iou.iter().sum::<f64>() / self.iou.len().max(1) as f64,
            100.0 * median(&self.centers),
            percent(self.right, self.matches),
            median(&self.milliseconds),
        )
    }
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

fn print_objects(run: &Run) {
    for object in run.truth.iter().filter(|object| object.frames_visible >= 8) {
        let Some(found) = run.score.matches.iter().find(|found| found.object == object.id) else {
            println!(
                "      {:12} missed, visible in {} frames, at {:.2?}, {:.2?} m",
                object.label,
                object.frames_visible,
                object.oriented_box.center(),
                object.oriented_box.lengths()
            );
            print_near(run, object);
            continue;
        };
        println!(
            "      {:12} IoU {:.2}, centre {:4.1} cm, {:.2?} m of {:.2?}, seen {} times",
            object.label,
            found.iou,
            100.0 * found.center_error,
            run.objects[found.estimate].oriented_box().lengths(),
            object.oriented_box.lengths(),
            run.objects[found.estimate].observations(),
        );
    }
    for &estimate in &run.score.unmatched {
        let object = &run.objects[estimate];
        let place = object.oriented_box().center();
        println!(
            "      {:12} is not there: at {place:.2?}, {:.2?} m, {} observations",
            object.label(),
            object.oriented_box().lengths(),
            object.observations()
        );
        print_truth_near(run, object);
    }
}

/// What is really there near an object that matches nothing.
fn print_truth_near(run: &Run, object: &MapObject) {
    for thing in &run.truth {
        let iou = thing.oriented_box.iou(&object.oriented_box());
        if iou > 0.0 {
            let (place, lengths) = (thing.oriented_box.center(), thing.oriented_box.lengths());
            println!("        there: {} IoU {iou:.2}, {lengths:.2?} m at {place:.2?}", thing.label);
        }
    }
}

/// What the map has, believed or not, near a thing that it misses.
fn print_near(run: &Run, missed: &TrueObject) {
    let place = missed.oriented_box.center();
    for own in run.objects.iter().chain(&run.doubted) {
        let center = own.oriented_box().center();
        let squared: f64 = center.iter().zip(place).map(|(a, b)| (a - b).powi(2)).sum();
        if squared < 0.04 {
            println!(
                "        near: {} {:?} {:?} {:?}, {:.2?} m at {center:.2?}, {} of {} views",
                own.label(),
                own.state(),
                own.relief(),
                own.support(),
                own.oriented_box().lengths(),
                own.observations(),
                own.frames_in_view()
            );
        }
    }
}

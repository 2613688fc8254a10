use dymlm_core::{BoundingBox, Detection};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::{DetectionRates, DetectorConfig};
use crate::noise::{NormalTable, Use, normal_quantile, stream};
use crate::render::{NOTHING, Rendering};
use crate::scene::{Part, Scene};

/// A 2D detector: from exact masks to boxes.
///
/// Its confidence in a thing, the sides of the box that it cuts and the label that it gives are smooth random
/// functions of time for each thing, so that failures come in bursts; a failure happens while the function is
/// below the normal quantile of its rate. Confidence grows with the size of the view. Jitter and surplus
/// boxes are drawn anew each frame. Of boxes of one label that overlap much, only the one with the highest
/// score remains. O(pixels).
#[derive(Debug, Clone)]
pub(crate) struct Detector {
    config: DetectorConfig,
    seed: u64,
    normals: NormalTable,
}

/// The pixels that show a thing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Visible {
    pub(crate) pixels: usize,
    pub(crate) x: [usize; 2],
    pub(crate) y: [usize; 2],
}

/// The smooth random functions of a thing.
#[derive(Debug, Clone, Copy)]
enum Mood {
    Confidence = 0,
    Label = 1,
    Left = 2,
    Right = 3,
    Bottom = 4,
}

/// Lowest score that is reported.
const MIN_SCORE: f64 = 0.25;
/// Median of the recorded people's scores, and a score near their maximum.
const USUAL_SCORE: f64 = 0.835;
const BEST_SCORE: f64 = 0.95;

impl Detector {
    pub(crate) fn new(config: DetectorConfig, seed: u64) -> Self {
        Self { config, seed, normals: NormalTable::new() }
    }

    /// The boxes of frame `index`, taken at `time` seconds, best score first.
    pub(crate) fn detect(
        &self,
        exact: &Rendering,
        visible: &[Option<Visible>],
        scene: &Scene,
        index: usize,
        time: f64,
    ) -> Vec<Detection> {
        let mut found = Vec::new();
        let mut surplus_boxes = Vec::new();
        for (instance, (thing, visible)) in scene.instances.iter().zip(visible).enumerate() {
            let (Some(label), Some(visible)) = (thing.label, visible) else { continue };
            let mut rng = stream(self.seed, Use::Boxes, index as u64, instance as u64 + 1);
            let moves = scene.is_mover(instance);
            if scene
                .people
                .iter()
                .take(self.config.overlooked_people)
                .any(|person| person.instance == instance)
            {
                continue;
            }
            if let Some(score) = self.score(visible, exact, moves, instance, time) {
                let label = if moves { label } else { self.label_given(label, instance, time) };
                let area = self.box_around(visible, exact, instance, time, &mut rng);
                found.extend(detection(label, score, area, exact));
            }
            if moves && rng.random_range(0.0..1.0) < self.config.surplus_rate {
                surplus_boxes.extend(surplus(label, visible, exact, &mut rng));
            }
        }
        self.merge(&mut found);
        found.append(&mut surplus_boxes);
        let mut rng = stream(self.seed, Use::Boxes, index as u64, 0);
        if rng.random_range(0.0..1.0) < self.config.invented_rate {
            found.extend(invented(exact, &mut rng));
        }
        found.sort_by(|a, b| b.score().total_cmp(&a.score()));
        found
    }

    /// The score of a view, or `None` when the view is missed.
    fn score(
        &self,
        visible: &Visible,
        exact: &Rendering,
        moves: bool,
        instance: usize,
        time: f64,
    ) -> Option<f64> {
        let share = visible.pixels as f64 / exact.depth.len() as f64;
        if share < self.config.min_area {
            return None;
        }
        let rates = if moves { &self.config.movers } else { &self.config.objects };
        let octaves = (share / rates.usual_size).log2();
        score_of(self.mood(Mood::Confidence, instance, time) + rates.size_gain * octaves, rates)
    }

    /// Drops the boxes that overlap much with a better one of the same label (class-wise non-maximum
    /// suppression).
    fn merge(&self, found: &mut Vec<Detection>) {
        found.sort_by(|a, b| b.score().total_cmp(&a.score()));
        let mut kept: Vec<Detection> = Vec::with_capacity(found.len());
        for detection in found.drain(..) {
            let doubles = |other: &Detection| {
                other.label() == detection.label()
                    && other.bounding_box().iou(&detection.bounding_box()) > self.config.merged_overlap
            };
            if !kept.iter().any(doubles) {
                kept.push(detection);
            }
        }
        found.append(&mut kept);
    }

    fn label_given(&self, label: &'static str, instance: usize, time: f64) -> &'static str {
        let confused = self.mood(Mood::Label, instance, time) < normal_quantile(self.config.confusion_rate);
        if confused { mistaken_for(label) } else { label }
    }

    /// The box around a view: sides at the image border stay there, the others jitter, and some are moved
    /// inwards.
    fn box_around(
        &self,
        visible: &Visible,
        exact: &Rendering,
        instance: usize,
        time: f64,
        rng: &mut ChaCha8Rng,
    ) -> [f64; 4] {
        let [x, y] = [visible.x, visible.y].map(|side| side.map(|c| c as f64));
        let (width, height) = (x[1] - x[0], y[1] - y[0]);
        let jitter = self.config.box_jitter * (width * height).sqrt();
        let mut side = |at: f64, border: f64, inwards: f64| {
            let normal = f64::from(self.normals.normal(rng.next_u64()));
            if at == border { at } else { at + jitter * normal + inwards }
        };
        let [cut, low_cut] = [self.config.cut_rate, self.config.low_cut_rate];
        [
            side(x[0], 0.0, width * self.cut(Mood::Left, cut, instance, time)),
            side(y[0], 0.0, 0.0),
            side(x[1], exact.width as f64, -width * self.cut(Mood::Right, cut, instance, time)),
            side(y[1], exact.height as f64, -height * self.cut(Mood::Bottom, low_cut, instance, time)),
        ]
    }

    /// The share of the extent that is cut off at a side, 0 most of the time.
    fn cut(&self, mood: Mood, rate: f64, instance: usize, time: f64) -> f64 {
        let below = normal_quantile(rate) - self.mood(mood, instance, time);
        // A cut begins with a fifth of the full depth and reaches all of it one sigma below the threshold.
        if below > 0.0 { self.config.cut_depth * (0.2 + 0.8 * below).min(1.0) } else { 0.0 }
    }

    /// A smooth random function of time: at each moment a standard normal variable, decorrelated after two
    /// burst times.
    fn mood(&self, mood: Mood, instance: usize, time: f64) -> f64 {
        let position = (time / self.config.burst_time).max(0.0);
        let (knot, fraction) = (position.floor(), position.fract());
        let at = |knot: f64| {
            let key = (instance as u64) << 4 | mood as u64;
            // The knot's number takes the larger of the stream's two fields, so that long recordings do not
            // repeat.
            f64::from(self.normals.normal(stream(self.seed, Use::Confidence, knot as u64, key).next_u64()))
        };
        let (before, after) = (1.0 - fraction, fraction);
        (before * at(knot) + after * at(knot + 1.0)) / before.hypot(after)
    }
}

/// Pixels and bounds of all things.
pub(crate) fn visible_things(exact: &Rendering, parts: &[Part], things: usize) -> Vec<Option<Visible>> {
    let mut visible: Vec<Option<Visible>> = vec![None; things];
    for (v, row) in exact.part.chunks(exact.width).enumerate() {
        let mut u = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let columns = [u, u + run.len()];
            u = columns[1];
            let Some(&part) = run.first().filter(|&&part| part != NOTHING) else { continue };
            let Some(part) = parts.get(usize::from(part)) else { continue };
            let Some(thing) = visible.get_mut(part.instance) else { continue };
            let seen = thing.get_or_insert(Visible { pixels: 0, x: columns, y: [v, v + 1] });
            seen.pixels += run.len();
            seen.x = [seen.x[0].min(columns[0]), seen.x[1].max(columns[1])];
            seen.y[1] = v + 1;
        }
    }
    visible
}

/// The score at a confidence (a standard normal variable): piecewise linear through the quantiles that the
/// rates name, `None` below the first.
fn score_of(confidence: f64, rates: &DetectionRates) -> Option<f64> {
    let top = (2.5, BEST_SCORE);
    let usual = (normal_quantile(0.5), USUAL_SCORE);
    let knots = [
        (normal_quantile(rates.missed).max(-3.7), MIN_SCORE),
        (normal_quantile(rates.below_half).max(-3.7), 0.5),
        (normal_quantile(rates.below_seven_tenths).max(-3.7), 0.7),
        if rates.below_seven_tenths < 0.4 { usual } else { top },
        top,
    ];
    if confidence < normal_quantile(rates.missed) {
        return None;
    }
    let mut score = MIN_SCORE;
    for pair in knots.windows(2) {
        let ((from, low), (to, high)) = (pair[0], pair[1]);
        if confidence >= from {
            let along = if to > from { ((confidence - from) / (to - from)).min(1.0) } else { 1.0 };
            score = low + along * (high - low);
        }
    }
    Some(score)
}

/// The label that detectors confuse with a thing's own.
fn mistaken_for(label: &'static str) -> &'static str {
    match label {
        "tv" | "book" => "laptop",
        "keyboard" => "remote",
        "mouse" => "cell phone",
        "bottle" | "potted plant" => "vase",
        "cup" => "bowl",
        "chair" => "couch",
        "teddy bear" => "dog",
        other => other,
    }
}

/// A second box around a part of a view.
fn surplus(label: &str, visible: &Visible, exact: &Rendering, rng: &mut ChaCha8Rng) -> Option<Detection> {
    let [x, y] = [visible.x, visible.y].map(|side| side.map(|c| c as f64));
    let (width, height) = (x[1] - x[0], y[1] - y[0]);
    let part = rng.random_range(0.4..0.8);
    let left = x[0] + width * rng.random_range(0.0..0.3);
    let top = y[0] + height * rng.random_range(0.0..1.0 - part);
    let score = rng.random_range(MIN_SCORE..0.6);
    detection(label, score, [left, top, left + 0.7 * width, top + part * height], exact)
}

/// A box around nothing.
fn invented(exact: &Rendering, rng: &mut ChaCha8Rng) -> Option<Detection> {
    const LABELS: [&str; 5] = ["remote", "cell phone", "sink", "bench", "suitcase"];
    let label = LABELS[rng.random_range(0..LABELS.len())];
    let (width, height) = (exact.width as f64, exact.height as f64);
    let left = width * rng.random_range(0.0..0.8);
    let top = height * rng.random_range(0.0..0.8);
    let right = left + width * rng.random_range(0.05..0.3);
    let bottom = top + height * rng.random_range(0.05..0.3);
    detection(label, rng.random_range(MIN_SCORE..0.5), [left, top, right, bottom], exact)
}

/// A detection clipped to the image; `None` when nothing of the box is left.
fn detection(label: &str, score: f64, sides: [f64; 4], exact: &Rendering) -> Option<Detection> {
    let [left, top, right, bottom] = sides.map(|side| side as f32);
    let area = BoundingBox::new(left, top, right, bottom).ok()?.clipped(exact.width, exact.height)?;
    Detection::new(label, score as f32, area).ok()
}

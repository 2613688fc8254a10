use std::f32::consts::TAU;

use parry3d::math::{Vec2, Vec3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::floor_plan::FloorPlan;
use super::furnishing::Furnished;
use super::station::Station;
use crate::scene::walk::Walk;

/// Free floor around a walker's middle, metres: half a stride.
pub(super) const CLEARANCE: f32 = 0.46;
/// Distance that walkers keep from the floor that the camera needs, metres.
const FROM_CAMERA: f32 = 0.5;
/// Smallest distance between two walkers' middles, metres.
const APART: f32 = 0.75;
/// Random ways that are tried for each of the two walkers.
const TRIES: usize = 800;
/// Smallest shares of the first and of the second way that the camera must see.
const SEEN: [f32; 2] = [0.35, 0.15];

/// A closed way over the floor.
pub(super) struct Way {
    points: Vec<[f32; 2]>,
    /// Points along the way, every few centimetres.
    pub(super) samples: Vec<Vec2>,
}

/// Ways over the free floor, to a large part in view: two that keep apart, or one on which two people can
/// walk; `None` when there is neither.
pub(super) fn choose_ways(
    furnished: &Furnished,
    station: &Station,
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Way>> {
    let first = choose_way(furnished, station, rng, |way| way.share_seen(furnished, station) >= SEEN[0])?;
    let apart = |way: &Way| {
        way.share_seen(furnished, station) >= SEEN[1]
            && way
                .samples
                .iter()
                .all(|a| first.samples.iter().all(|b| a.distance_squared(*b) > APART * APART))
    };
    match choose_way(furnished, station, rng, apart) {
        Some(second) => Some(vec![first, second]),
        None => first.has_room_for_two().then(|| vec![first]),
    }
}

/// Whether the camera sees enough of the ways.
pub(super) fn are_seen(ways: &[Way], furnished: &Furnished, station: &Station) -> bool {
    ways.iter().zip(SEEN).all(|(way, share)| way.share_seen(furnished, station) >= share)
}

/// The walks of two people: each on its own way, or both on one way at the same speed, half a round apart.
pub(super) fn walks(ways: &[Way], rng: &mut ChaCha8Rng) -> Option<[Walk; 2]> {
    // 0.6 to 1 m/s: an unhurried walk indoors.
    let [speed, other_speed] = std::array::from_fn(|_| rng.random_range(0.6..1.0));
    let [start, other_start] = std::array::from_fn(|_| rng.random_range(0.0..20.0));
    let first = ways.first()?;
    let walk = Walk::new(&first.points, speed, start);
    let half_round = 0.5 * f64::from(walk.length());
    let other = match ways.get(1) {
        Some(second) => Walk::new(&second.points, other_speed, other_start),
        None => Walk::new(&first.points, speed, start + half_round),
    };
    Some([walk, other])
}

fn choose_way(
    furnished: &Furnished,
    station: &Station,
    rng: &mut ChaCha8Rng,
    accept: impl FnMut(&Way) -> bool,
) -> Option<Way> {
    let from_camera = |at: Vec2| station.footprint.distance(at) > FROM_CAMERA;
    choose_free_way(&furnished.floor, rng, from_camera, accept)
}

/// A way over free floor that `allowed` accepts at every point and `accept` as a whole.
pub(super) fn choose_free_way(
    floor: &FloorPlan,
    rng: &mut ChaCha8Rng,
    allowed: impl Fn(Vec2) -> bool,
    mut accept: impl FnMut(&Way) -> bool,
) -> Option<Way> {
    (0..TRIES).find_map(|_| {
        let points = loop_of_points(floor.half, rng);
        // Checking the points alone rejects most bad ways.
        let free = |at: Vec2| floor.clearance(at) > CLEARANCE && allowed(at);
        if !points.iter().all(|&point| free(point.into())) {
            return None;
        }
        let way = Way::new(points);
        let good = way.samples.iter().all(|&at| free(at)) && way.turns_gently() && accept(&way);
        good.then_some(way)
    })
}

/// Five to eight points around a random ellipse, moved a little.
fn loop_of_points(half: Vec2, rng: &mut ChaCha8Rng) -> Vec<[f32; 2]> {
    let center = Vec2::new(rng.random_range(-half.x..half.x), rng.random_range(-half.y..half.y));
    let axis = Vec2::from_angle(rng.random_range(0.0..TAU));
    let radii = [rng.random_range(0.5..2.4), rng.random_range(0.22..1.2)];
    let count = rng.random_range(5..=8_u8);
    let mut point = |k: u8| {
        let (sin, cos) = (TAU * f32::from(k) / f32::from(count)).sin_cos();
        let moved = rng.random_range(0.85..1.15);
        (center + moved * (radii[0] * cos * axis + radii[1] * sin * axis.perp())).to_array()
    };
    (0..count).map(&mut point).collect()
}

impl Way {
    /// A walk along the way with random speed and start.
    pub(super) fn walk(&self, rng: &mut ChaCha8Rng) -> Walk {
        Walk::new(&self.points, rng.random_range(0.6..1.0), rng.random_range(0.0..20.0))
    }

    fn new(points: Vec<[f32; 2]>) -> Self {
        let walk = Walk::new(&points, 1.0, 0.0);
        let count = (walk.length() / 0.05).ceil().max(1.0);
        let samples =
            (0..count as u32).map(|k| walk.at(f64::from(k) * f64::from(walk.length() / count)).position);
        Self { samples: samples.collect(), points }
    }

    /// Whether a walker can take all turns: the chord of every 0.4 m of the way is longer than 0.3 m.
    fn turns_gently(&self) -> bool {
        let n = self.samples.len();
        (0..n).all(|k| self.samples[k].distance(self.samples[(k + 8) % n]) > 0.3)
    }

    /// Share of the way that is in the camera's view, 0..=1.
    fn share_seen(&self, furnished: &Furnished, station: &Station) -> f32 {
        let chest = |at: &Vec2| Vec3::new(at.x, at.y, 1.1);
        let probes = || self.samples.iter().step_by(8);
        let seen = probes().filter(|at| station.sees(furnished, chest(at), None)).count();
        seen as f32 / probes().count() as f32
    }

    /// Whether two people half a round apart never come close.
    fn has_room_for_two(&self) -> bool {
        let n = self.samples.len();
        (0..n).all(|k| self.samples[k].distance(self.samples[(k + n / 2) % n]) > APART)
    }
}

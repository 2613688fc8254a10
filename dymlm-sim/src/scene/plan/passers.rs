use parry3d::math::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::PlanGrid;
use super::building_plan::Plan;
use super::raster::{Counts, Raster};
use super::round::Order;
use super::route::Route;
use crate::scene::tour::Tour;
use crate::scene::walk::Walk;

/// A closed way through a part of the building, and those who walk on it all the time.
pub(super) struct Passage {
    /// Points along the way.
    pub(super) way: Vec<Vec2>,
    pub(super) walks: Vec<Walk>,
}

/// Free floor on all sides of a walker's middle, metres: legs and arms swing out to 0.46 m, and a way cuts corners
/// by up to a step of its grid.
const CLEARANCE: f32 = 0.6;
/// Distance between the stops of a way, metres, and how many of them it has.
const SPACING: f32 = 7.0;
const STOPS: usize = 6;
/// Distance between the points of a way, metres.
const STEP: f32 = 0.5;
/// Distance that walkers keep from the camera and from each other, metres.
const APART: f32 = 0.95;
/// Moments at which that is looked at, a second.
const MOMENTS: f64 = 10.0;
/// The camera stands where it stays for this long, seconds.
const STANDS: f64 = 2.0;
/// Starts and speeds that are tried for each walker.
const TRIES: usize = 200;

/// Ways through all of the building, each with up to `most` walkers, who start where they meet neither the camera nor
/// each other within `seconds`.
pub(super) fn passages(
    plan: &Plan,
    tour: &Tour,
    seconds: f64,
    most: usize,
    rng: &mut ChaCha8Rng,
) -> Vec<Passage> {
    let moments = (seconds * MOMENTS).ceil().min(1e6) as u32;
    let time = |moment: u32| f64::from(moment) / MOMENTS;
    let camera: Vec<Vec2> =
        (0..moments).map(|moment| tour.scene_from_carrier(time(moment)).translation.truncate()).collect();
    let free = off_stops(plan, &camera);
    let Ok(route) = Route::new(&plan.grid, &free, CLEARANCE) else { return Vec::new() };
    let stops = route.stops(&Counts::of(&free), plan.grid.resolution, SPACING);
    let order = Order::of(&route, &stops);
    let mut taken = vec![camera];
    let mut passages = Vec::new();
    for stops in order.stops.chunks(STOPS).filter(|stops| stops.len() > 1) {
        let way = closed_way(&route, stops);
        let points: Vec<[f32; 2]> = way.iter().map(Vec2::to_array).collect();
        let length = f64::from(Walk::new(&points, 1.0, 0.0).length());
        let mut walks = Vec::new();
        for _ in 0..most {
            let found = (0..TRIES).find_map(|_| {
                // 0.6 to 1 m/s: an unhurried walk indoors.
                let walk = Walk::new(&points, rng.random_range(0.6..1.0), rng.random_range(0.0..length));
                let places = (0..moments).map(|moment| {
                    let at = walk.at(time(moment)).position;
                    taken.iter().all(|others| others[moment as usize].distance(at) > APART).then_some(at)
                });
                let places: Vec<Vec2> = places.collect::<Option<_>>()?;
                Some((walk, places))
            });
            if let Some((walk, places)) = found {
                taken.push(places);
                walks.push(walk);
            }
        }
        if !walks.is_empty() {
            passages.push(Passage { way, walks });
        }
    }
    passages
}

/// The free cells without those around the places where the camera stands for a while: ways past these would meet it.
fn off_stops(plan: &Plan, camera: &[Vec2]) -> Raster {
    let PlanGrid { width, height, resolution, origin, .. } = plan.grid;
    let mut free = plan.free.clone();
    let while_later = camera.iter().skip((STANDS * MOMENTS) as usize);
    let mut stops: Vec<Vec2> =
        camera.iter().zip(while_later).filter(|(now, later)| now == later).map(|(now, _)| *now).collect();
    stops.dedup();
    for stop in stops {
        let reach = f64::from(APART - CLEARANCE) + resolution;
        let cells = |axis: usize, count: usize| {
            let middle = f64::from(stop[axis]) - origin[axis];
            let [low, high] = [middle - reach, middle + reach].map(|c| (c / resolution).max(0.0) as usize);
            low.min(count)..(high + 1).min(count)
        };
        for y in cells(1, height) {
            cells(0, width).for_each(|x| free.cells[y * width + x] = false);
        }
    }
    free
}

/// Points along the way through some stops and back to the first one.
fn closed_way(route: &Route, stops: &[usize]) -> Vec<Vec2> {
    let mut points = Vec::new();
    let nexts = stops.iter().cycle().skip(1);
    for (&stop, &next) in stops.iter().zip(nexts) {
        let mut from = route.point(stop);
        for corner in route.way(&route.lengths_from(stop), next) {
            let steps = (from.distance(corner) / STEP).ceil().max(1.0) as u32;
            points.extend((0..steps).map(|k| from.lerp(corner, k as f32 / steps as f32)));
            from = corner;
        }
    }
    points
}

use std::f32::consts::TAU;

use parry3d::math::{Vec2, Vec3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::BuildingPlan;
use super::raster::Counts;
use super::route::Route;
use crate::scene::tour::Tour;

/// Smallest distance between stops, metres: a depth camera sees well up to there.
const SPACING: f32 = 4.0;
/// By how much stops move apart when the round takes too long, and how far at most, metres.
const WIDER: f32 = 1.15;
const WIDEST: f32 = 16.0;

/// A round through the open floor of a plan that takes at most `seconds`: the camera goes from stop to stop, looks
/// around at each, and comes back to the first one from another side where there is another way. When the time
/// does not suffice, stops are farther apart, and in the end the last ones are left out.
pub(super) fn round(plan: &BuildingPlan, seconds: f64, rng: &mut ChaCha8Rng) -> Tour {
    let plan = plan.plan();
    let free = Counts::of(&plan.free);
    let first = rng.random_range(0.0..1.0_f32);
    let mut spacing = SPACING;
    loop {
        let mut stops = plan.route.stops(&free, plan.grid.resolution, spacing);
        let begin = (first * stops.len() as f32) as usize;
        let begin = begin.min(stops.len().saturating_sub(1));
        stops.rotate_left(begin);
        // Turning alone takes this long; the ways need not be known then.
        let turning = stops.len() as f64 * Tour::seconds_to_turn(TAU);
        if turning <= seconds || spacing > WIDEST {
            let order = Order::of(&plan.route, &stops);
            let ways = order.ways(&plan.route);
            let mut kept = stops.len();
            let mut tour = order.tour(&plan.route, &ways, kept);
            while spacing > WIDEST && kept > 1 && tour.seconds() > seconds {
                kept -= 1;
                tour = order.tour(&plan.route, &ways, kept);
            }
            if spacing > WIDEST || tour.seconds() <= seconds {
                return tour;
            }
        }
        spacing *= WIDER;
    }
}

/// Stops in the order of a short round.
pub(super) struct Order {
    pub(super) stops: Vec<usize>,
}

/// Attempts to shorten a round.
const PASSES: usize = 60;

impl Order {
    /// The nearest stop next, then pairs of ways are exchanged as long as that shortens the round (2-opt).
    pub(super) fn of(route: &Route, stops: &[usize]) -> Self {
        let between: Vec<Vec<u32>> = stops
            .iter()
            .map(|&stop| {
                let lengths = route.lengths_from(stop);
                stops.iter().map(|&other| lengths[other]).collect()
            })
            .collect();
        let n = stops.len();
        let mut order = vec![0];
        let mut left: Vec<usize> = (1..n).collect();
        while let Some(&last) = order.last() {
            let nearest = (0..left.len()).min_by_key(|&k| (between[last][left[k]], left[k]));
            let Some(nearest) = nearest else { break };
            order.push(left.remove(nearest));
        }
        let way = |a: usize, b: usize| u64::from(between[a][b]);
        for _ in 0..PASSES {
            let mut is_shorter = false;
            for i in 1..n {
                for j in i + 1..n {
                    let (a, b, c, d) = (order[i - 1], order[i], order[j], order[(j + 1) % n]);
                    if way(a, c) + way(b, d) < way(a, b) + way(c, d) {
                        order[i..=j].reverse();
                        is_shorter = true;
                    }
                }
            }
            if !is_shorter {
                break;
            }
        }
        Self { stops: order.into_iter().map(|k| stops[k]).collect() }
    }

    /// The corners of the way from each stop to the next one.
    fn ways(&self, route: &Route) -> Vec<Vec<Vec2>> {
        let pairs = self.stops.iter().zip(self.stops.iter().skip(1));
        pairs.map(|(&stop, &next)| route.way(&route.lengths_from(stop), next)).collect()
    }

    /// The tour through the first `count` stops, of which these are the ways, and back to the first one.
    fn tour(&self, route: &Route, ways: &[Vec<Vec2>], count: usize) -> Tour {
        let on_floor = |point: Vec2| Vec3::new(point.x, point.y, 0.0);
        let stops = &self.stops[..count.min(self.stops.len())];
        let (Some(&first), Some(&last)) = (stops.first(), stops.last()) else {
            return Tour::begin(Vec3::ZERO, 0.0);
        };
        let mut tour = Tour::begin(on_floor(route.point(first)), 0.0);
        tour.turn(TAU);
        for way in &ways[..stops.len() - 1] {
            for &corner in way {
                tour.go_to(on_floor(corner));
            }
            tour.turn(TAU);
        }
        for corner in route.way(&route.lengths_from(last), first) {
            tour.go_to(on_floor(corner));
        }
        tour
    }
}

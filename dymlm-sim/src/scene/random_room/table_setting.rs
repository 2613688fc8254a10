use parry3d::math::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::floor_plan::{FloorPlan, Footprint};
use crate::scene::builder::Builder;
use crate::scene::table_top::TableTop;
use crate::scene::things;

/// Something that stands on a table: how to build it, and its half lengths along its axes, metres.
type Thing = (fn(&mut Builder, [f32; 3], f32), [f32; 2]);

const MONITOR: Thing = (things::monitor, [0.275, 0.095]);
const KEYBOARD: Thing = (things::keyboard, [0.225, 0.075]);
const MOUSE: Thing = (things::mouse, [0.035, 0.057]);
const LAPTOP: Thing = (things::laptop, [0.165, 0.185]);

/// Things that may stand anywhere on a table.
const OTHERS: [Thing; 9] = [
    (things::cup, [0.065, 0.045]),
    (things::bowl, [0.087, 0.087]),
    (things::bottle, [0.038, 0.038]),
    (things::book, [0.082, 0.117]),
    (things::two_books, [0.09, 0.122]),
    (things::orange, [0.042, 0.042]),
    (things::vase, [0.082, 0.082]),
    (things::small_plant, [0.105, 0.105]),
    (things::teddy_bear, [0.155, 0.17]),
];

/// Gap between things, metres.
const GAP: f32 = 0.015;

/// Puts random things on a table: on half of the tables screens at the back with keyboards before them, on
/// the others a laptop if it fits; and on all of them up to `count` other things, whose centres are at least
/// `free_front` metres from the front edge.
pub(super) fn set_table(
    b: &mut Builder,
    top: &TableTop,
    count: usize,
    free_front: f32,
    rng: &mut ChaCha8Rng,
) {
    let half = 0.5 * Vec2::from(top.size);
    let mut setting = FloorPlan::new(half - Vec2::splat(0.015));
    let mut put = |thing: Thing, at: Vec2, yaw: f32| {
        let (build, size) = thing;
        let fits = setting.take(Footprint::new(at, yaw, size), GAP);
        if fits {
            build(b, top.point(at.to_array()), top.yaw + yaw);
        }
        fits
    };

    let mut sway = |reach: f32| rng.random_range(-reach..reach);
    if half.y > 0.25 && sway(1.0) > 0.0 {
        let places: &[f32] = if half.x > 0.7 { &[-0.36, 0.36] } else { &[0.0] };
        for &x in places {
            let x = x + sway(0.03);
            put(MONITOR, Vec2::new(x, half.y - 0.145 + sway(0.005)), sway(0.08));
            put(KEYBOARD, Vec2::new(x, 0.12 - half.y), sway(0.1));
            put(MOUSE, Vec2::new(x + 0.31, 0.12 - half.y + sway(0.02)), sway(0.3));
        }
    } else if half.y > 0.22 {
        put(LAPTOP, Vec2::new(sway(half.x - 0.2), sway(0.04) - 0.03), sway(0.3));
    }
    for _ in 0..count {
        let thing = OTHERS[rng.random_range(0..OTHERS.len())];
        // Several places are tried, since much of the table may be occupied.
        for _ in 0..8 {
            let at =
                Vec2::new(rng.random_range(-half.x..half.x), rng.random_range(free_front - half.y..half.y));
            if put(thing, at, rng.random_range(-0.8..0.8)) {
                break;
            }
        }
    }
}

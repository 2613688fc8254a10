//! What walls part: rooms on both sides of a thin wall have ceilings, walls and desks of their own, however
//! well these agree.

use crate::common::{Rectangle, World, camera, level, look_at, upright};
use dymlm_core::Pose;
use dymlm_planes::{MapPlane, PlaneMap};

/// Half the thickness of the wall.
const HALF: f64 = 0.06;
/// The wall ends here: beyond, one walks from room to room.
const END: f64 = -1.0;

/// Two rooms along x, with a wall between them that ends before the rooms do.
fn rooms() -> World {
    let wall = |x: f64| Rectangle { center: [x, 1.0, 1.25], half_sides: [[0.0, 2.0, 0.0], [0.0, 0.0, 1.25]] };
    let mut parts = vec![level([0.0, 0.0, 0.0], 3.0, 3.0), wall(-HALF), wall(HALF)];
    parts.push(upright([0.0, END, 1.25], HALF, 1.25));
    for side in [-1.0, 1.0] {
        let middle = side * (1.5 + 0.5 * HALF);
        let half = 1.5 - 0.5 * HALF;
        parts.push(upright([middle, 3.0, 1.25], half, 1.25));
        parts.push(level([middle, 1.0, 2.5], half, 2.0));
        parts.push(level([side * (HALF + 0.35), 1.6, 0.74], 0.35, 0.6));
    }
    World::of(&parts)
}

/// Along the wall of one room (-1 or 1), and past its end, into the other.
fn views(side: f64) -> impl Iterator<Item = Pose> {
    (0..24).map(move |k| {
        let s = f64::from(k % 8) / 8.0;
        match k / 8 {
            0 => look_at([side * 2.5, -0.6 + 0.8 * s, 1.45], [side * 0.1, 3.0, 1.5 + 0.6 * s]),
            1 => look_at([side * 1.5, 0.5 + s, 1.5], [0.0, 1.7, 0.7]),
            _ => look_at([side * (1.2 - s), -1.9, 1.5], [-side * (0.6 * s), 0.6, 0.1]),
        }
    })
}

fn map_of(views: impl Iterator<Item = Pose>) -> PlaneMap {
    let (world, mut mapper) = (rooms(), crate::common::mapper());
    for (k, view) in views.enumerate() {
        mapper.insert(&world.frame(camera(), &view, k as u64), None, &[], &view).unwrap();
    }
    mapper.into_map()
}

/// The planes that are level or upright at a coordinate, with the side of the wall that they are on.
fn sides(map: &PlaneMap, axis: usize, at: f64) -> Vec<f64> {
    let is_there = |plane: &&MapPlane| {
        plane.plane().normal()[axis].abs() > 0.98 && (plane.centroid()[axis] - at).abs() < 0.05
    };
    let mut sides: Vec<f64> = map.iter().filter(is_there).map(|plane| plane.centroid()[0].signum()).collect();
    sides.sort_by(f64::total_cmp);
    sides
}

#[test]
fn what_a_wall_parts_stays_two_and_what_goes_on_past_its_end_is_one() {
    let map = map_of(views(-1.0).chain(views(1.0)).chain(views(-1.0)));
    assert_eq!(sides(&map, 1, 3.0), [-1.0, 1.0], "walls");
    assert_eq!(sides(&map, 2, 2.5), [-1.0, 1.0], "ceilings");
    assert_eq!(sides(&map, 2, 0.74), [-1.0, 1.0], "desks");
    assert_eq!(sides(&map, 2, 0.0).len(), 1, "floor");
}

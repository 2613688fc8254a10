//! A ramp is a plane of its own, however gentle, and the floors before and behind it are level.

use crate::common::{Rectangle, World, camera, level, look_at};
use dymlm_planes::MapPlane;

/// Rise of the ramp, which is 4 m long: 5 degrees, as for wheelchairs.
const RISE: f64 = 0.35;

/// A floor up to x = 3, a ramp up to x = 7, and the floor that it leads to.
fn ramped() -> World {
    let ramp =
        Rectangle { center: [5.0, 0.0, RISE / 2.0], half_sides: [[2.0, 0.0, RISE / 2.0], [0.0, 1.2, 0.0]] };
    World::of(&[level([1.5, 0.0, 0.0], 1.5, 1.2), ramp, level([8.5, 0.0, RISE], 1.5, 1.2)])
}

/// Height of the ground below a place along the way.
fn ground(x: f64) -> f64 {
    RISE * ((x - 3.0) / 4.0).clamp(0.0, 1.0)
}

#[test]
fn the_floors_before_and_behind_a_ramp_are_other_planes() {
    let (world, mut mapper) = (ramped(), crate::common::mapper());
    for k in 0..48 {
        // There and back, first towards the ramp from afar, when only its lower end is in view.
        let (x, ahead) =
            if k < 24 { (0.3 * f64::from(k), 2.5) } else { (9.5 - 0.3 * f64::from(k - 24), -2.5) };
        let view = look_at([x, 0.2, ground(x) + 1.4], [x + ahead, 0.0, ground(x + ahead)]);
        mapper.insert(&world.frame(camera(), &view, k as u64), None, &[], &view).unwrap();
    }
    let map = mapper.into_map();
    let mut planes: Vec<&MapPlane> = map.iter().collect();
    planes.sort_by(|a, b| a.centroid()[0].total_cmp(&b.centroid()[0]));
    let slopes: Vec<f64> = planes.iter().map(|plane| plane.plane().normal()[0].asin().to_degrees()).collect();
    let expected = [0.0, -(RISE / 4.0).atan().to_degrees(), 0.0];
    assert_eq!(slopes.len(), expected.len(), "{slopes:?}");
    for (slope, expected) in slopes.iter().zip(expected) {
        assert!((slope - expected).abs() < 0.3, "{slopes:?}");
    }
}

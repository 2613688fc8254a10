//! What a plane says of its shape: its boundary, its area, where it holds a point and where rays meet it.

use dymlm_core::{PinholeCamera, Pose};
use dymlm_planes::{BoundaryPolygon, PlaneMap};

use crate::common::{World, camera, detector, empty_map, look_at, upright};

fn kinect() -> PinholeCamera {
    PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap()
}

/// Maps what a camera sees of a world from a pose, as if it were seen from another one.
fn insert(map: &mut PlaneMap, world: &World, camera: PinholeCamera, [view, said]: [&Pose; 2], seed: u64) {
    let frame = world.frame(camera, view, seed);
    let planes = detector().detect(&frame, None, &[]).unwrap().to_vec();
    map.insert(&planes, &frame, said).unwrap();
}

fn areas(boundary: &[BoundaryPolygon]) -> Vec<f64> {
    boundary.iter().map(BoundaryPolygon::area).collect()
}

/// Regression: cells between the samples of a wall 2.5 m away, which lie farther apart than the cells are
/// wide, were within the boundary and not in the area.
#[test]
fn the_area_is_that_within_the_boundary() {
    for (camera, depth) in [(kinect(), 2.0), (kinect(), 2.5), (camera(), 2.5)] {
        let wall = World::of(&[upright([0.0, depth, 1.0], 0.8, 0.6)]);
        let (mut map, view) = (empty_map(), look_at([0.0, 0.0, 1.0], [0.0, depth, 1.0]));
        for seed in 0..3 {
            insert(&mut map, &wall, camera, [&view; 2], seed);
        }
        let (boundary, area) = map.iter().next().unwrap().boundary_and_area();
        let within: f64 = areas(&boundary).iter().sum();
        let truth = 1.6 * 1.2;
        assert!((within - truth).abs() < 0.06 * truth, "{depth} m: {within} square metres within");
        assert!((area - within).abs() < 0.02 * truth, "{depth} m: {area} and {within} square metres");
    }
}

/// Regression: what was seen from aside while the camera rested was the rim of what it had seen in the
/// middle.
#[test]
fn what_was_looked_at_for_long_is_one_with_what_is_beside_it() {
    let wall = World::of(&[upright([0.0, 2.0, 1.0], 6.0, 4.0)]);
    let mut map = empty_map();
    for step in 0..39 {
        let x = 0.1 * f64::from(step - 30).max(0.0);
        let view = look_at([x, 0.0, 1.0], [x, 2.0, 1.0]);
        insert(&mut map, &wall, kinect(), [&view; 2], 1);
    }
    let areas = areas(&map.iter().next().unwrap().boundary());
    assert_eq!(areas.len(), 1, "{areas:?}");
}

/// Regression: where poses were some centimetres off, rays passed through inliers that the area counts.
#[test]
fn rays_meet_all_inliers() {
    let depth = 2.005;
    let wall = World::of(&[upright([0.0, depth, 1.0], 6.0, 4.0)]);
    let mut map = empty_map();
    for step in 0..23 {
        let (x, off) = if step < 20 { (0.0, 0.0) } else { (1.2 + 0.02 * f64::from(step - 20), 0.045) };
        let at = |off: f64| look_at([x, off, 1.0], [x, depth + off, 1.0]);
        insert(&mut map, &wall, camera(), [&at(0.0), &at(off)], 1);
    }
    let plane = map.iter().next().unwrap();
    let inliers: Vec<[f64; 3]> = plane.inlier_points().map(|point| point.map(f64::from)).collect();
    let held = inliers.iter().filter(|point| plane.holds(**point)).count();
    let is_met = |point: &&[f64; 3]| map.cast_ray([point[0], 0.0, point[2]], [0.0, 1.0, 0.0], 10.0).is_some();
    let met = inliers.iter().filter(is_met).count();
    assert_eq!([held, met], [inliers.len(); 2]);
}

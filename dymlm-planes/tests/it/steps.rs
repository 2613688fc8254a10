//! Steps between parallel surfaces: what a key frame shows as two stays two, though the map would take it for
//! one; the upper side of something flat is no support; no plane goes through a step.

use crate::common::{Rectangle, World, camera, detector, level, look_at, upright};
use dymlm_core::{FrameId, PinholeCamera, Pose};
use dymlm_planes::{MapPlane, PlaneMap, RejectionCause};

/// A cupboard's front with an oven above it, which stands 4 cm farther back, seen from a distance.
fn cupboard() -> World {
    World::of(&[upright([0.0, 2.0, 0.55], 0.5, 0.55), upright([0.0, 2.04, 1.3], 0.5, 0.2)])
}

/// A view of the cupboard from a distance, metres.
fn from(distance: f64) -> Pose {
    look_at([0.0, 2.0 - distance, 1.2], [0.0, 2.0, 0.9])
}

/// A table with a book 3 cm high and a box 20 cm high on it.
fn table() -> World {
    World::of(&[
        level([0.0, 2.0, 0.70], 0.8, 0.5),
        level([-0.35, 2.0, 0.73], 0.2, 0.25),
        level([0.35, 2.0, 0.90], 0.2, 0.25),
    ])
}

fn map_of(world: &World, views: impl IntoIterator<Item = Pose>) -> PlaneMap {
    let mut mapper = crate::common::mapper();
    for (view, seed) in views.into_iter().zip(0..) {
        mapper.insert(&world.frame(camera(), &view, seed), None, &[], &view).unwrap();
    }
    mapper.into_map()
}

#[test]
fn what_a_key_frame_shows_as_two_stays_two() {
    let near = map_of(&cupboard(), [1.2, 1.3, 3.2, 3.3, 1.4, 1.5, 3.4].map(from));
    let mut places: Vec<f64> = near.iter().map(|plane| plane.centroid()[1]).collect();
    places.sort_by(f64::total_cmp);
    let is_at = |place: f64, y: f64| (place - y).abs() < 0.005;
    assert!(matches!(places[..], [a, b] if is_at(a, 2.0) && is_at(b, 2.04)), "{places:?}");

    // From so far the step is within the noise.
    let far = map_of(&cupboard(), [3.2, 3.3, 3.4, 3.5].map(from));
    assert_eq!(far.len(), 1);
}

/// Regression: a step that one or two key frames showed parted two planes for ever, and those with which they
/// merged.
#[test]
fn a_step_that_hardly_any_key_frame_shows_is_an_error() {
    let flat = World::of(&[upright([0.0, 2.0, 0.75], 0.5, 0.75)]);
    let mut mapper = crate::common::mapper();
    let mut insert = |world: &World, aside: f64, seed: u64| {
        let view = look_at([aside, 0.8, 1.2], [0.0, 2.0, 0.9]);
        mapper.insert(&world.frame(camera(), &view, seed), None, &[], &view).unwrap();
        mapper.map().iter().chain(mapper.map().candidates()).count()
    };
    for (aside, seed) in [(-0.15, 0), (0.15, 1)] {
        assert_eq!(insert(&cupboard(), aside, seed), 2);
    }
    let planes: Vec<usize> =
        (2..30).map(|seed| insert(&flat, if seed % 2 == 0 { -0.15 } else { 0.15 }, seed)).collect();
    assert_eq!((planes[0], planes[10], planes[27]), (2, 2, 1), "{planes:?}");
}

/// Who stands close before a board on a wall reads the board where the middle of the wall is: that does not say
/// that the two are one surface.
#[test]
fn a_board_before_a_wall_stays_one_however_long_it_fills_the_view() {
    let wall = upright([0.0, 2.0, 1.0], 1.5, 1.0);
    let board = upright([0.0, 1.97, 1.0], 0.5, 0.4);
    let near = (0..4).map(|k| (1.3, 0.1 * f64::from(k)));
    let close = (0..80).map(|k| (0.6, 0.05 * f64::from(k % 3)));
    let views = near.clone().chain(close).chain(near);
    let view = |(distance, aside): (f64, f64)| look_at([aside, 1.97 - distance, 1.0], [0.0, 2.0, 1.0]);
    let map = map_of(&World::of(&[wall, board]), views.map(view));
    assert_eq!(map.len(), 2);
}

#[test]
fn a_key_frame_that_showed_a_step_is_removed_without_a_trace() {
    let mut map = map_of(&cupboard(), [1.2, 3.2].map(from));
    map.remove(FrameId::new(0)).unwrap();
    let far = map_of(&cupboard(), [3.2].map(from));
    let observations = |map: &PlaneMap| map.candidates().map(MapPlane::observations).collect::<Vec<_>>();
    assert_eq!(observations(&map), observations(&far));
}

#[test]
fn the_upper_side_of_something_flat_is_no_support() {
    let views = (0..4).map(|k| look_at([0.1 * f64::from(k) - 0.2, 0.9, 1.6], [0.0, 2.0, 0.7]));
    let map = map_of(&table(), views);
    assert_eq!(map.len(), 3);
    let supports = |x: f64, z: f64| -> Vec<f64> {
        let near = map.supports_near([x, 2.0, z], 0.06);
        near.map(|plane| (100.0 * plane.centroid()[2]).round()).collect()
    };
    assert_eq!(supports(0.0, 0.74), [70.0], "the table beside them");
    assert!(!supports(-0.35, 0.74).contains(&73.0), "the book");
    assert_eq!(supports(0.35, 0.92), [90.0], "the box");
}

/// Slanted planes (normals along none of the axes) of twelve views from a distance, metres, that enter the map,
/// and planes that are rejected because they go through a step.
fn slanted_and_rejected(world: &World, distance: f64) -> (usize, usize) {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let (mut detector, mut slanted, mut rejected) = (detector(), 0, 0);
    for k in 0..12 {
        let s = f64::from(k) / 12.0;
        let view = look_at([1.5 + 0.2 * s, 3.4 - distance, 1.45], [0.6 - 0.4 * s, 3.4, 1.4]);
        let planes = detector.detect(&world.frame(camera, &view, k as u64), None, &[]).unwrap();
        let is_slanted = |normal: [f64; 3]| normal.iter().all(|c| c.abs() < 0.985);
        slanted += planes.iter().filter(|plane| is_slanted(view.rotate(plane.plane.normal()))).count();
        let through = |cause: &RejectionCause| matches!(cause, RejectionCause::ThroughStep { .. });
        rejected += detector.rejected().iter().filter(|rejected| through(&rejected.cause)).count();
    }
    (slanted, rejected)
}

#[test]
fn no_plane_goes_through_a_step_that_the_noise_hides() {
    let wall = upright([0.0, 3.4, 1.2], 2.5, 1.3);
    let board = upright([0.0, 3.34, 1.02], 0.5, 1.02);
    let (slanted, rejected) = slanted_and_rejected(&World::of(&[wall, board]), 3.6);
    assert_eq!(slanted, 0);
    assert!(rejected >= 3, "{rejected}: the noise makes such planes");
}

#[test]
fn a_slanted_surface_between_two_parallel_ones_is_a_plane() {
    let slope = Rectangle { center: [0.0, 3.36, 1.2], half_sides: [[0.18, -0.04, 0.0], [0.0, 0.0, 1.2]] };
    let sides = [upright([-1.18, 3.4, 1.2], 1.0, 1.2), upright([1.18, 3.32, 1.2], 1.0, 1.2)];
    let (slanted, rejected) = slanted_and_rejected(&World::of(&[slope, sides[0], sides[1]]), 2.0);
    assert!(slanted >= 12 && rejected == 0, "{slanted} seen, {rejected} rejected");
}

//! A body that was moved in the octree.

use dymlm_core::{Point, PointCloud};
use dymlm_octree::{CellState, Octree, OctreeConfig, OctreeMotion};

const HERE: Point = [1.02, 0.02, 0.02];
const THERE: Point = [1.52, 0.02, 0.02];

fn map() -> Octree {
    let mut map = Octree::new(OctreeConfig::default()).unwrap();
    for _ in 0..4 {
        map.insert_scan([0.0; 3], &[HERE]).unwrap();
    }
    map
}

#[test]
fn a_moved_body_is_at_its_new_place_as_surely_as_it_was_at_the_old_one() {
    let mut map = map();
    let before = map.log_odds(HERE.map(f64::from)).unwrap();
    let motion = map.move_body(&[HERE], &[THERE], &[]);
    assert_eq!((motion.emptied, motion.occupied), (1, 1));
    assert_eq!(map.state(HERE.map(f64::from)), CellState::Free);
    assert_eq!(map.log_odds(THERE.map(f64::from)), Some(before));
    // Looked through at its new place, it is removed.
    for _ in 0..20 {
        map.insert_scan([0.0; 3], &[[2.02, 0.02, 0.02]]).unwrap();
    }
    assert_eq!(map.state(THERE.map(f64::from)), CellState::Free);
}

#[test]
fn what_stayed_in_its_cell_keeps_it() {
    let mut map = map();
    let motion = map.move_body(&[HERE], &[THERE], &[[1.04, 0.04, 0.04]]);
    assert_eq!((motion.emptied, motion.occupied), (0, 1));
    assert_eq!(map.state(HERE.map(f64::from)), CellState::Occupied);
}

#[test]
fn points_outside_the_map_are_passed_over() {
    let mut map = map();
    let motion = map.move_body(&[HERE, [f32::NAN; 3]], &[[1e30, 0.0, 0.0], THERE], &[[f32::INFINITY; 3]]);
    assert_eq!((motion.emptied, motion.occupied), (1, 1));
    assert_eq!(
        Octree::new(OctreeConfig::default()).unwrap().move_body(&[], &[], &[]),
        OctreeMotion::default()
    );
}

/// Regression: the colour stayed where the body had been.
#[test]
fn colors_go_with_the_body() {
    let mut config = OctreeConfig::default();
    config.color = true;
    let cloud = PointCloud::with_colors(vec![HERE], vec![[200, 10, 20]]).unwrap();
    let mut map = Octree::from_cloud(&cloud, config).unwrap();
    map.move_body(&[HERE], &[THERE], &[]);
    let [here, there] = [HERE, THERE].map(|place| map.color(place.map(f64::from)));
    assert_eq!((here, there), (None, Some([200, 10, 20])));
}

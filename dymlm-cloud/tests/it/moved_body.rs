//! A body of the cloud map that was moved: it stands at its new place, and nothing is left at the old one.

use dymlm_cloud::{CloudMap, CloudMapConfig, Error, Selection};
use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_geometry::OrientedBox;

/// A wall at 2 m, and before it a red square of 20 cm at 1.5 m, `x` metres to the right.
fn frame(time: f64, x: Option<f64>) -> Frame {
    let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
    let (mut depth, mut color) = (Vec::new(), Vec::new());
    for (u, v) in (0..120).flat_map(|v| (0..160).map(move |u| (f64::from(u), f64::from(v)))) {
        let [s, t, _] = camera.back_project([u, v], 1.5);
        let is_square = x.is_some_and(|x| (s - x).abs() < 0.1 && t.abs() < 0.1);
        depth.push(if is_square { 1.5 } else { 2.0 });
        color.push(if is_square { [200, 0, 0] } else { [90; 3] });
    }
    let depth = DepthImage::new(160, 120, depth).unwrap();
    Frame::new(time, camera, depth, Some(ColorImage::new(160, 120, color).unwrap())).unwrap()
}

fn region(x: f64) -> OrientedBox {
    OrientedBox::new(Pose::new([x, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]).unwrap(), [0.24, 0.24, 0.1]).unwrap()
}

fn right(x: f64) -> Pose {
    Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn red_points(map: &CloudMap, selection: Selection) -> Vec<[f32; 3]> {
    let cloud = map.point_cloud(selection);
    let colors = cloud.colors().unwrap();
    cloud.points().iter().zip(colors).filter(|(_, c)| c[0] > 150).map(|(p, _)| *p).collect()
}

#[test]
fn it_stands_at_its_new_place_and_nowhere_else() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let world = Pose::identity();
    // For long, so that the place it goes to has been looked through often.
    for i in 0..30 {
        map.insert(&frame(f64::from(i), Some(-0.2)), None, &world).unwrap();
    }
    let before = red_points(&map, Selection::Static);
    let voxels = map.held_voxels();
    let motion = map.move_body(&region(-0.2), &right(0.4), |_| true);
    assert_eq!(map.held_voxels(), voxels, "a whole number of voxels to the side: none fall together");
    assert_eq!(motion.from.len(), motion.to.len());
    assert!(motion.from.len() >= before.len());

    let after = red_points(&map, Selection::Static);
    assert_eq!(after.len(), before.len());
    for (from, to) in before.iter().zip(&after) {
        assert!((to[0] - from[0] - 0.4).abs() < 1e-3 && (to[1] - from[1]).abs() < 1e-3);
    }
    assert!(map.static_points_in(&region(-0.2)).is_empty());
    assert_eq!(map.static_points_in(&region(0.2)).len(), motion.to.len());

    // It stays when frames see it there, and goes when they look through.
    for i in 30..60 {
        map.insert(&frame(f64::from(i), Some(0.2)), None, &world).unwrap();
    }
    assert!(red_points(&map, Selection::Static).len() >= before.len());
    for i in 60..400 {
        map.insert(&frame(f64::from(i), None), None, &world).unwrap();
    }
    assert!(red_points(&map, Selection::Static).is_empty());
}

#[test]
fn what_is_no_part_of_it_stays_with_its_evidence() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    for i in 0..5 {
        map.insert(&frame(f64::from(i), Some(0.0)), None, &Pose::identity()).unwrap();
    }
    let before = map.point_cloud(Selection::Static).len();
    let left_half = map.move_body(&region(0.0), &right(0.5), |place| place[0] < 0.0);
    assert!(left_half.from.iter().all(|point| point[0] < 0.0) && !left_half.from.is_empty());
    let rest = map.static_points_in(&region(0.0));
    assert!(rest.iter().all(|point| point[0] >= 0.0) && !rest.is_empty());
    assert_eq!(map.point_cloud(Selection::Static).len(), before);
}

#[test]
fn nothing_there_moves_nothing_and_far_is_off_the_lattice() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    assert!(map.move_body(&region(0.0), &right(1.0), |_| true).from.is_empty());
    map.insert(&frame(0.0, Some(0.0)), None, &Pose::identity()).unwrap();
    let motion = map.move_body(&region(0.0), &right(1e12), |_| true);
    assert!(!motion.from.is_empty());
    assert!(map.static_points_in(&region(0.0)).is_empty());
    assert!(red_points(&map, Selection::All).is_empty());
}

#[test]
fn frames_that_saw_it_before_cannot_be_taken_out() {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let first = frame(0.0, Some(0.0));
    map.insert(&first, None, &Pose::identity()).unwrap();
    map.move_body(&region(0.0), &right(0.4), |_| true);
    let voxels = map.held_voxels();
    assert_eq!(map.remove(&first, None, &Pose::identity()), Err(Error::NotInserted { timestamp: 0.0 }));
    assert_eq!(map.held_voxels(), voxels);
}

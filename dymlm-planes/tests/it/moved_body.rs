//! Planes of a body that was moved.

use crate::common::{all_planes, mapper, snapshot};
use dymlm_core::{DepthImage, Frame, FrameId, PinholeCamera, PlaneId, Pose};
use dymlm_planes::{Error, PlaneMap, PlaneMapper};

/// A wall at 2 m and a board before it, at 1.4 m, 0.4 m wide, about x = -0.3.
fn map(frames: usize) -> PlaneMapper {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let is_board = |u: usize, v: usize| {
        let [x, y, _] = camera.back_project([u as f64, v as f64], 1.4);
        (x + 0.3).abs() < 0.2 && y.abs() < 0.25
    };
    let depth = (0..640 * 480).map(|i| if is_board(i % 640, i / 640) { 1.4 } else { 2.0 }).collect();
    let depth = DepthImage::new(640, 480, depth).unwrap();
    let frame = Frame::new(0.0, camera, depth, None).unwrap();
    let mut mapper = mapper();
    for _ in 0..frames {
        mapper.insert(&frame, None, &[], &Pose::identity()).unwrap();
    }
    mapper
}

fn is_board([x, y, z]: [f64; 3]) -> bool {
    (x + 0.3).abs() < 0.25 && y.abs() < 0.3 && (z - 1.4).abs() < 0.05
}

/// The id of the plane nearest to the camera.
fn board(map: &PlaneMap) -> PlaneId {
    all_planes(map).into_iter().min_by(|a, b| a.centroid()[2].total_cmp(&b.centroid()[2])).unwrap().id()
}

#[test]
fn a_face_of_it_goes_where_it_goes() {
    let mut mapper = map(3);
    let id = board(mapper.map());
    let before = mapper.map().plane(id).unwrap().clone();
    let others = all_planes(mapper.map()).len() - 1;
    // To the right and turned by a quarter about the vertical: it faces along x now.
    let half = 0.5_f64.sqrt();
    let motion = Pose::new([1.0, 0.1, 1.2], [0.0, half, 0.0, half]).unwrap();
    let moved = mapper.map_mut().move_body(&motion, is_board).unwrap();
    assert_eq!(moved, [id]);
    let after = mapper.map().plane(id).unwrap();
    let expected = motion.transform_point(before.centroid());
    for axis in 0..3 {
        assert!((after.centroid()[axis] - expected[axis]).abs() < 1e-3);
        let normal = motion.rotate(before.plane().normal());
        assert!((after.plane().normal()[axis] - normal[axis]).abs() < 1e-3);
    }
    assert_eq!(after.observations(), before.observations());
    assert!((after.area() - before.area()).abs() < 0.3 * before.area());
    assert_eq!(all_planes(mapper.map()).len() - 1, others);
    assert!(all_planes(mapper.map()).iter().all(|plane| !plane.holds([-0.3, 0.0, 1.4])));
    assert!(after.holds(expected));

    // What the key frames added went with it.
    let mut map = mapper.map().clone();
    for key_frame in 0..3 {
        map.remove(FrameId::new(key_frame)).unwrap();
    }
    assert!(all_planes(&map).is_empty());
}

#[test]
fn a_plane_that_is_but_touched_loses_what_is_the_bodys() {
    let mut mapper = map(2);
    let half_of_it = |place: [f64; 3]| is_board(place) && place[0] < -0.35;
    let id = board(mapper.map());
    let before = mapper.map().plane(id).unwrap().inlier_voxels();
    assert!(mapper.map_mut().move_body(&Pose::identity(), half_of_it).unwrap().is_empty());
    let after = mapper.map().plane(id).unwrap();
    assert!(after.inlier_voxels() < before);
    assert!(!after.holds([-0.45, 0.0, 1.4]) && after.holds([-0.2, 0.0, 1.4]));
}

#[test]
fn what_is_gone_stays_gone_when_another_body_takes_a_part_of_it() {
    let mut mapper = map(3);
    let id = board(mapper.map());
    let is_confirmed = |mapper: &PlaneMapper| mapper.map().plane(id).unwrap().is_confirmed();
    mapper.map_mut().judge([[[-1.0; 3], [2.0; 3]]], None, 0.5, |place| Some(is_board(place)));
    assert!(!is_confirmed(&mapper));
    let half_of_it = |place: [f64; 3]| is_board(place) && place[0] < -0.35;
    mapper.map_mut().move_body(&Pose::identity(), half_of_it).unwrap();
    assert!(!is_confirmed(&mapper));
    // Without a look at it the judgement stays.
    let mut looked_at = mapper.map().clone();
    looked_at.judge([], Some([[-1.0; 3], [2.0; 3]]), 0.5, |place| Some(is_board(place)));
    assert!(!looked_at.plane(id).unwrap().is_confirmed());
    let asked = std::cell::Cell::new(0);
    looked_at.judge([], Some([[5.0; 3], [9.0; 3]]), 0.5, |_| {
        asked.set(asked.get() + 1);
        Some(false)
    });
    let is_back = looked_at.plane(id).unwrap().is_confirmed();
    assert_eq!((asked.get(), is_back), (0, false), "nobody looked at its place");
    looked_at.judge([], Some([[-1.0; 3], [2.0; 3]]), 0.5, |_| Some(false));
    assert!(looked_at.plane(id).unwrap().is_confirmed());

    // A part that was free and is back adds nothing to another part that is free later.
    let half = |place: [f64; 3], is_left: bool| is_board(place) && (place[0] < -0.35) == is_left;
    for is_left in [true, false] {
        let whole = [[-1.0; 3], [2.0; 3]];
        looked_at.judge([whole], None, 1.0, |place| Some(half(place, is_left)));
        assert!(looked_at.plane(id).unwrap().is_confirmed());
        looked_at.judge([], Some(whole), 1.0, |_| Some(false));
    }
    looked_at.judge([[[-0.46, 0.0, 1.39], [-0.44, 0.01, 1.41]]], None, 0.0, |_| Some(false));
    assert!(looked_at.plane(id).unwrap().is_confirmed(), "nothing of it is free");

    // Put down elsewhere it is there, until that place is judged.
    mapper.map_mut().move_body(&Pose::new([0.0, 0.0, 0.1], [0.0, 0.0, 0.0, 1.0]).unwrap(), is_board).unwrap();
    assert!(is_confirmed(&mapper));
}

/// Regression: what was pushed and then carried had less than its share of all its inliers, and was cut off
/// the plane instead of moved; or what it had left behind came along.
#[test]
fn what_a_plane_has_left_behind_neither_holds_it_nor_comes_along() {
    let mut mapper = map(3);
    let id = board(mapper.map());
    let is_left = |[x, ..]: [f64; 3]| x < -0.3;
    mapper.map_mut().judge([[[-1.0; 3], [2.0; 3]]], None, 0.9, |at| Some(is_board(at) && is_left(at)));
    let up = Pose::new([0.0, 0.1, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let standing: Vec<[f64; 3]> =
        mapper.map().plane(id).unwrap().inlier_points().map(|at| at.map(f64::from)).collect();
    assert!(standing.iter().all(|&at| !is_left(at)));
    let moved = mapper.map_mut().move_body(&up, |at| is_board(at) && !is_left(at)).unwrap();
    assert_eq!(moved, [id]);
    let plane = mapper.map().plane(id).unwrap();
    assert!(plane.is_confirmed() && plane.inlier_points().all(|at| at[0] > -0.35));
    let apart = plane.inlier_points().count().abs_diff(standing.len());
    assert!(10 * apart < standing.len(), "{apart} of {}", standing.len());
}

#[test]
fn out_of_reach_is_refused_and_changes_nothing() {
    let mut mapper = map(1);
    let before = snapshot(mapper.map());
    let far = Pose::new([1e9, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let refused = mapper.map_mut().move_body(&far, is_board);
    assert!(matches!(refused, Err(Error::OutOfReach { .. })));
    assert_eq!(snapshot(mapper.map()), before);
}

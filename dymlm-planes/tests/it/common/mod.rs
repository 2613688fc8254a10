//! The rooms of the tests, and what maps them.

#![allow(dead_code, unused_imports, clippy::unwrap_used, reason = "tests; not every test uses all of it")]

pub(crate) use dymlm_core::vector3::{difference as minus, dot};
use dymlm_core::{Pose, SensorModel};
use dymlm_planes::{MapPlane, PlaneConfig, PlaneDetector, PlaneMap, PlaneMapper};
pub(crate) use dymlm_test_support::{Cuboid, Cylinder, Rectangle, World, look_at, small_camera as camera};

/// A level rectangle.
pub(crate) fn level(center: [f64; 3], half_x: f64, half_y: f64) -> Rectangle {
    Rectangle::level(center, half_x, half_y)
}

/// An upright rectangle across y.
pub(crate) fn upright(center: [f64; 3], half_x: f64, half_z: f64) -> Rectangle {
    Rectangle::upright(center, half_x, half_z)
}

/// A room's corner with a table: floor, two walls, a table top.
pub(crate) fn room() -> World {
    World::of(&[
        level([0.0, 0.0, 0.0], 3.0, 3.0),
        upright([0.0, 1.6, 1.2], 3.0, 1.2),
        Rectangle { center: [1.4, 0.0, 1.2], half_sides: [[0.0, 3.0, 0.0], [0.0, 0.0, 1.2]] },
        level([-0.2, 0.5, 0.75], 0.5, 0.35),
    ])
}

/// Six views of [`room`].
pub(crate) fn room_views() -> Vec<Pose> {
    (0..6)
        .map(|k| {
            let s = f64::from(k);
            look_at([-0.9 + 0.12 * s, -1.5 + 0.05 * s, 1.5 + 0.03 * s], [0.1 + 0.05 * s, 0.6, 0.6])
        })
        .collect()
}

pub(crate) fn mapper() -> PlaneMapper {
    PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect()).unwrap()
}

pub(crate) fn empty_map() -> PlaneMap {
    PlaneMap::new(PlaneConfig::default().map, SensorModel::kinect()).unwrap()
}

pub(crate) fn detector() -> PlaneDetector {
    PlaneDetector::new(&PlaneConfig::default().detector, &SensorModel::kinect()).unwrap()
}

/// Confirmed planes and candidates, in the order of their ids.
pub(crate) fn all_planes(map: &PlaneMap) -> Vec<&MapPlane> {
    let mut planes: Vec<&MapPlane> = map.iter().chain(map.candidates()).collect();
    planes.sort_by_key(|plane| plane.id());
    planes
}

/// Copies of [`all_planes`].
pub(crate) fn snapshot(map: &PlaneMap) -> Vec<MapPlane> {
    all_planes(map).into_iter().cloned().collect()
}

//! A thing that no detector reports crosses a room and comes to rest: it is masked at once while it moves,
//! leaves no trace in any map, and is mapped once it has proved to stay.

use dymlm::core::{Frame, PinholeCamera, Point, Pose};
use dymlm::octree::CellState;
use dymlm::{Detections, FrameReport, MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_test_support::{Cuboid, Rectangle, World, look_at};

/// A trolley's full lengths, metres; it rolls along x.
const LENGTHS: [f64; 3] = [0.5, 0.4, 0.8];
const RATE: f64 = 10.0;
/// When it comes in, and when it comes to rest, seconds.
const COMES: f64 = 6.0;
const RESTS: f64 = 9.0;
const END: f64 = 20.0;

/// Where its middle is.
fn place(time: f64) -> Option<[f64; 3]> {
    (time >= COMES).then(|| [-1.2 + 0.6 * (time.min(RESTS) - COMES), 2.0, 0.5 * LENGTHS[2]])
}

fn world(time: f64) -> World {
    let mut world = World::of(&[
        Rectangle::level([0.0, 1.0, 0.0], 3.0, 3.0),
        Rectangle::upright([0.0, 3.3, 1.3], 3.0, 1.3),
    ]);
    world.cuboids.extend(place(time).map(|center| Cuboid {
        world_from_cuboid: Pose::new(center, [0.0, 0.0, 0.0, 1.0]).unwrap(),
        lengths: LENGTHS,
    }));
    world
}

fn record(builder: &mut MapBuilder, from: f64, to: f64) -> Vec<FrameReport> {
    let camera = PinholeCamera::new(160, 120, 131.25, 131.25, 79.5, 59.5).unwrap();
    let frames = (from * RATE) as u64..(to * RATE) as u64;
    let insert = |index: u64| {
        let time = index as f64 / RATE;
        let (sin, cos) = (time * 0.9).sin_cos();
        let pose = look_at([0.04 * sin, 0.02 * cos, 1.2], [0.05 * cos, 2.0, 0.75 + 0.03 * sin]);
        let depth = world(time).frame(camera, &pose, index).depth().clone();
        let frame = Frame::new(time, camera, depth, None).unwrap();
        builder.insert(&frame, Detections::Found(&[]), &pose).unwrap()
    };
    frames.map(insert).collect()
}

/// Points of the cloud and centres of occupied cells of the octree, above the floor and before the wall.
fn held(map: &MultiLevelMap) -> [Vec<Point>; 2] {
    let is_between = |point: &Point| point[1] < 3.1 && point[2] > 0.1;
    let cloud = map.cloud().point_cloud(Selection::Static);
    let occupied = map.octree().leaves().filter(|leaf| leaf.state == CellState::Occupied);
    [
        cloud.points().iter().copied().filter(is_between).collect(),
        occupied.map(|leaf| leaf.center.map(|c| c as f32)).filter(is_between).collect(),
    ]
}

#[test]
fn it_is_masked_while_it_moves_and_mapped_once_it_stays() {
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    let before = record(&mut builder, 0.0, COMES);
    assert!(before.iter().all(|report| report.movers.is_empty()), "a mover in an empty room");

    let passing = record(&mut builder, COMES, RESTS);
    let found = passing.iter().filter(|report| report.movers.len() == 1 && report.movers[0].label.is_none());
    assert!(found.count() + 1 >= passing.len());
    let ids: Vec<_> = passing.iter().filter_map(|report| report.movers.first()).map(|m| m.track_id).collect();
    assert!(ids.iter().all(|id| *id == ids[0]), "{ids:?}");
    assert_eq!(held(builder.map()).map(|points| points.len()), [0, 0], "traces of what moves");

    let resting = record(&mut builder, RESTS, END);
    assert!(resting.iter().skip(10 * RATE as usize).all(|report| report.movers.is_empty()), "it stays");
    let rest = place(END).unwrap();
    for points in held(builder.map()) {
        let is_of_it = |point: &&Point| (f64::from(point[0]) - rest[0]).abs() < 0.5 * LENGTHS[0] + 0.05;
        assert!(points.iter().filter(is_of_it).count() > 50, "{} of it", points.len());
        assert_eq!(points.iter().filter(is_of_it).count(), points.len(), "traces of where it went");
    }
}

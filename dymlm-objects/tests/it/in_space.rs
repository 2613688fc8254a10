//! What one object is, is decided in space: through walls, from other sides, at any attitude and rate.
use crate::common::{Scene, looking_at, mapper, near, upright};
use dymlm_core::{Frame, ObjectId, Plane, PlaneId, Pose, SensorModel};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{
    MapObject, ObjectConfig, ObjectMapper, ObjectReport, ObjectView, SupportPlane, SupportingPlanes,
};
use dymlm_test_support::Rectangle;

const FLOOR: PlaneId = PlaneId::new(0);

/// A floor, and walls across y that are known from both sides.
struct Walls(Vec<f64>);

impl SupportingPlanes for Walls {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        if point[2].abs() <= reach {
            found.push(SupportPlane::new(FLOOR, Plane::new([0.0, 0.0, 1.0], 0.0).unwrap()));
        }
        for (index, &y) in self.0.iter().enumerate() {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                if (point[1] - y).abs() <= reach {
                    let id = PlaneId::new((1 + 2 * index + side) as u64);
                    found.push(SupportPlane::new(id, Plane::new([0.0, sign, 0.0], -sign * y).unwrap()));
                }
            }
        }
    }
}

fn room(boxes: Vec<OrientedBox>, walls: &[f64]) -> Scene {
    let mut rectangles = vec![Rectangle::level([0.0; 3], 50.0, 50.0)];
    rectangles.extend(walls.iter().map(|&y| Rectangle::upright([0.0, y, 1.5], 50.0, 1.5)));
    Scene::with_rectangles(boxes, rectangles)
}

fn chair(x: f64, y: f64) -> OrientedBox {
    upright([x, y, 0.45], 0.0, [0.5, 0.5, 0.9])
}

fn show(
    mapper: &mut ObjectMapper,
    scene: &Scene,
    (time, pose): (f64, Pose),
    labels: &[(usize, &str)],
    planes: &dyn SupportingPlanes,
) -> ObjectReport {
    let (frame, detections) = scene.detected(time, &pose, labels);
    mapper.insert(&ObjectView::new(&frame, &detections, &pose), planes).unwrap()
}

fn boxes(mapper: &ObjectMapper) -> Vec<OrientedBox> {
    mapper.map().objects().map(MapObject::oriented_box).collect()
}

/// A chair behind a wall and one before it, in one line of sight, each seen from its own room. No
/// camera goes from one to the other in less than a second.
#[test]
fn chairs_on_both_sides_of_a_wall_are_two() {
    for (behind, before, pause) in [(3.9, 2.6, 8.0), (3.9, 2.6, 1.0), (3.75, 3.05, 8.0), (3.75, 3.05, 1.0)] {
        let scene = room(vec![chair(0.0, behind), chair(0.05, before)], &[3.4]);
        let planes = Walls(vec![3.4]);
        let mut mapper = mapper();
        for step in 0..20 {
            let pose = near([0.4, 7.0, 1.2], step, [0.0, behind, 0.4]);
            show(&mut mapper, &scene, (0.1 * step as f64, pose), &[(0, "chair")], &planes);
        }
        assert_eq!(mapper.map().len(), 1, "{:?}", boxes(&mapper));
        let mut rejected = 0;
        for step in 0..20 {
            let pose = near([0.3, 0.0, 1.2], step, [0.0, before, 0.4]);
            let report =
                show(&mut mapper, &scene, (pause + 2.0 + 0.1 * step as f64, pose), &[(1, "chair")], &planes);
            rejected += report.rejected.len();
            assert!(report.removed.is_empty() && report.merged.is_empty(), "step {step}: {report:?}");
        }
        let found = boxes(&mapper);
        assert_eq!((found.len(), rejected), (2, 0), "{found:?}");
        for (own, truth) in found.iter().zip(&scene.boxes) {
            assert!(own.iou(truth) > 0.6, "{} {own:?}", own.iou(truth));
            let through =
                own.corners().iter().any(|corner| (corner[1] - 3.4) * (truth.center()[1] - 3.4) < -0.03);
            assert!(!through, "a box reaches through the wall: {:?}", own.corners());
        }
    }
}

/// A chair 10 cm before a wall, its far side never seen: such things are deeper than what is left.
#[test]
fn no_box_grows_through_a_wall() {
    let scene = room(vec![upright([0.0, 3.15, 0.45], 0.0, [0.5, 0.3, 0.9])], &[3.4]);
    let far_end = |walls: Vec<f64>| {
        let mut mapper = mapper();
        for step in 0..10 {
            let pose = near([0.0, 1.0, 0.5], step, [0.0, 3.0, 0.45]);
            show(&mut mapper, &scene, (0.1 * step as f64, pose), &[(0, "chair")], &Walls(walls.clone()));
        }
        let [own] = boxes(&mapper)[..] else { panic!("{:?}", boxes(&mapper)) };
        own.corners().iter().map(|corner| corner[1]).fold(0.0, f64::max)
    };
    assert!(
        far_end(vec![]) > 3.45 && far_end(vec![3.4]) < 3.41,
        "{} {}",
        far_end(vec![]),
        far_end(vec![3.4])
    );
}

/// The same views with thirty rooms around, and with one.
#[test]
fn what_is_elsewhere_changes_nothing() {
    let scene = room(vec![chair(0.0, 2.0), chair(0.9, 2.3)], &[]);
    let planes = Walls(vec![]);
    let run = |others: usize| {
        let mut mapper = mapper();
        let show_at = |mapper: &mut ObjectMapper, shift: Pose, step: usize| {
            let pose = near([0.4, -0.5, 1.2], step, [0.3, 2.0, 0.4]);
            let (frame, detections) = scene.detected(step as f64, &pose, &[(0, "chair"), (1, "chair")]);
            mapper.insert(&ObjectView::new(&frame, &detections, &(shift * pose)), &planes).unwrap()
        };
        for other in 1..=others {
            let shift = [8.0 * (other % 10) as f64, 8.0 * (other / 10) as f64, 0.0];
            show_at(&mut mapper, Pose::new(shift, [0.0, 0.0, 0.0, 1.0]).unwrap(), 0);
        }
        let reports: Vec<_> = (1..8).map(|step| show_at(&mut mapper, Pose::identity(), step)).collect();
        let counts =
            |report: &ObjectReport| (report.associated.len(), report.updated.len(), report.merged.len());
        (boxes(&mapper), reports.iter().map(counts).collect::<Vec<_>>())
    };
    // One room tells the vertical.
    assert_eq!(run(30), run(1));
}

/// Two cups near each other, one before the other as often as not.
#[test]
fn cups_seen_together_stay_two() {
    let cup = |x: f64, y: f64| upright([x, y, 0.05], 0.0, [0.08, 0.08, 0.1]);
    let scene = room(vec![cup(0.0, 1.0), cup(0.0, 1.4)], &[]);
    let mut mapper = mapper();
    for step in 0..40_u32 {
        let angle = 0.1 * f64::from(step);
        let pose = looking_at([1.2 * angle.sin(), 1.2 - 1.2 * angle.cos(), 0.7], [0.0, 1.2, 0.0], 0.0);
        show(&mut mapper, &scene, (0.1 * f64::from(step), pose), &[(0, "cup"), (1, "cup")], &Walls(vec![]));
    }
    let found = boxes(&mapper);
    assert_eq!(found.len(), 2, "{found:?}");
    for (own, truth) in found.iter().zip(&scene.boxes) {
        assert!(own.iou(truth) > 0.5, "{} {own:?}", own.iou(truth));
    }
}

/// Around the origin, at an angle from the front.
fn around(degrees: f64, step: usize) -> Pose {
    let (sin, cos) = degrees.to_radians().sin_cos();
    near([1.8 * sin, -1.8 * cos, 0.9], step, [0.0, 0.0, 0.2])
}

fn cube() -> Scene {
    room(vec![upright([0.0, 0.0, 0.225], 0.0, [0.45; 3])], &[])
}

/// A cube learnt from the front, and met again from another side after a pause.
#[test]
fn what_is_met_again_from_another_side_is_the_same_and_grows() {
    let scene = cube();
    let sides = [0.0, 90.0, 180.0].into_iter();
    let poses: Vec<Pose> = sides.flat_map(|degrees| (0..24).map(move |step| around(degrees, step))).collect();
    let mut failed = Vec::new();
    for label in ["microwave", "suitcase", "chair", "thing of no known size"] {
        let views: Vec<_> = poses.iter().map(|pose| scene.detected(0.0, pose, &[(0, label)])).collect();
        for side in [1, 2] {
            let mut mapper = mapper();
            let mut associated = 0;
            for step in 0..48 {
                let view = if step < 24 { step } else { 24 * side + step % 24 };
                let (frame, detections) = &views[view];
                let time = step as f64 / 30.0 + if step < 24 { 0.0 } else { 5.0 };
                let frame = Frame::new(time, *frame.camera(), frame.depth().clone(), None).unwrap();
                let report = mapper
                    .insert(&ObjectView::new(&frame, detections, &poses[view]), &Walls(vec![]))
                    .unwrap();
                associated += if step < 24 { 0 } else { report.associated.len() };
            }
            let found = boxes(&mapper);
            let iou = found.iter().map(|own| own.iou(&scene.boxes[0])).fold(0.0, f64::max);
            if found.len() != 1 || associated < 22 || iou < 0.7 {
                failed.push((label, side, found.len(), associated, iou));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// What a robot maps that has stood before a thing for 40 s.
fn rested_before(scene: &Scene) -> ObjectMapper {
    let mut mapper = mapper();
    let at_rest = around(0.0, 0);
    let (frame, detections) = scene.detected(0.0, &at_rest, &[(0, "thing of no known size")]);
    for step in 0..1200_u32 {
        let frame = Frame::new(f64::from(step) / 30.0, scene.camera, frame.depth().clone(), None).unwrap();
        mapper.insert(&ObjectView::new(&frame, &detections, &at_rest), &Walls(vec![])).unwrap();
    }
    mapper
}

/// A robot that stands before a cube for 40 s and then goes around it.
#[test]
fn what_was_seen_from_one_place_for_long_grows() {
    let scene = cube();
    let mut mapper = rested_before(&scene);
    assert_eq!(mapper.map().len(), 1);
    for step in 0..60 {
        let pose = around(3.0 * step as f64, step);
        show(
            &mut mapper,
            &scene,
            (40.0 + 0.1 * step as f64, pose),
            &[(0, "thing of no known size")],
            &Walls(vec![]),
        );
    }
    let found = boxes(&mapper);
    let iou = found.iter().map(|own| own.iou(&scene.boxes[0])).fold(0.0, f64::max);
    assert!(found.len() == 1 && iou > 0.8, "{iou}: {found:?}");
}

/// Regression: each detection's score counted fully, and a robot that rested for a minute where the detector takes
/// a sofa for a chair had to see it for as long from elsewhere.
#[test]
fn what_a_thing_is_called_from_one_place_for_long_does_not_outvote_the_way_around_it() {
    let scene = cube();
    let mut mapper = rested_before(&scene);
    for step in 0..180 {
        let (time, pose) = (40.0 + 0.1 * step as f64, around(2.0 * step as f64, step));
        show(&mut mapper, &scene, (time, pose), &[(0, "another thing")], &Walls(vec![]));
    }
    let labels: Vec<&str> = mapper.map().objects().map(MapObject::label).collect();
    assert_eq!(labels, ["another thing"]);
}

/// A box on the floor as a camera sees it that is rolled, or that looks steeply down, or that is told what is
/// up.
#[test]
fn no_attitude_of_the_camera_is_assumed() {
    let scene = room(vec![upright([0.0, 0.0, 0.15], 0.4, [0.4, 0.3, 0.3])], &[1.2]);
    let seen_from = |place: [f64; 3], roll: f64, up: Option<[f64; 3]>| {
        let mut config = ObjectConfig::default();
        config.parameterization.up = up;
        let mut mapper = ObjectMapper::new(config, SensorModel::kinect()).unwrap();
        for step in 0..20_u32 {
            let angle = 0.4 * f64::from(step);
            let place = [place[0] + 0.2 * angle.sin(), place[1], place[2] + 0.1 * angle.cos()];
            let pose = looking_at(place, [0.0, 0.0, 0.1], roll.to_radians());
            show(&mut mapper, &scene, (0.1 * f64::from(step), pose), &[(0, "thing")], &Walls(vec![1.2]));
        }
        let found = boxes(&mapper);
        assert_eq!(found.len(), 1, "from {place:?}, rolled by {roll}");
        found[0].iou(&scene.boxes[0])
    };
    let (ahead, above) = ([0.3, -1.6, 1.0], [0.1, -0.9, 1.7]);
    let own = [0.0, 90.0, 180.0, -90.0].map(|roll| seen_from(ahead, roll, None));
    let steep = [0.0, 90.0].map(|roll| seen_from(above, roll, None));
    let told = seen_from(ahead, 90.0, Some([0.0, 0.0, 1.0]));
    assert!(own.iter().chain(&steep).chain([&told]).all(|&iou| iou > 0.8), "{own:?}, {steep:?}, {told}");
}

/// All tests of the association are asked at any rate.
#[test]
fn motion_goes_on_at_any_rate() {
    let scene = cube();
    for rate in [1.0, 5.0, 30.0] {
        let mut mapper = mapper();
        for step in 0..8_u32 {
            let shown = (f64::from(step) / rate, around(5.0 * f64::from(step), 0));
            let report = show(&mut mapper, &scene, shown, &[(0, "thing")], &Walls(vec![]));
            let is_predicted = report.associated.iter().all(|pair| pair.tests.motion_iou > Some(0.5));
            assert!(
                step == 0 || (report.associated.len() == 1 && (is_predicted || step < 3)),
                "{rate} Hz: {report:?}"
            );
        }
        assert!(boxes(&mapper)[0].iou(&scene.boxes[0]) > 0.8, "{rate} Hz");
    }
}

#[test]
fn a_region_without_end_holds_all_objects() {
    let scene = room(vec![chair(0.0, 2.6)], &[]);
    let mut mapper = mapper();
    for step in 0..5 {
        let pose = near([0.3, 0.0, 1.2], step, [0.0, 2.6, 0.4]);
        show(&mut mapper, &scene, (0.1 * step as f64, pose), &[(0, "chair")], &Walls(Vec::new()));
    }
    let held = mapper.map().objects().count() + mapper.map().candidates().count();
    assert!(held > 0);
    let endless = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
    assert!(mapper.remove_where([[1e9; 3], [f64::INFINITY; 3]], |_| true).is_empty());
    assert_eq!(mapper.remove_where(endless, |_| true).len(), held);
    assert!(mapper.map().is_empty() && mapper.map().candidates().next().is_none());
}

#[test]
fn what_is_far_is_forgotten_unless_somebody_carries_it() {
    let scene = room(vec![chair(0.0, 2.0), chair(0.0, 8.0), chair(0.0, 14.0)], &[]);
    let planes = Walls(vec![]);
    let mut mapper = mapper();
    for (index, y) in [2.0, 8.0, 14.0].into_iter().enumerate() {
        for step in 0..6 {
            let pose = near([0.4, y - 1.8, 1.2], step, [0.0, y, 0.4]);
            let time = 0.1 * (10 * index + step) as f64;
            show(&mut mapper, &scene, (time, pose), &[(index, "chair")], &planes);
        }
    }
    let ids: Vec<ObjectId> = mapper.map().objects().map(MapObject::id).collect();
    let bytes = mapper.map().memory_bytes();
    mapper.hold(ids[2]);
    mapper.forget_outside([0.0, 2.0, 0.5], 3.0);
    assert_eq!(mapper.map().objects().map(MapObject::id).collect::<Vec<_>>(), [ids[0], ids[2]]);
    assert!(mapper.map().memory_bytes() < bytes);
    mapper.forget_outside([0.0; 3], f64::NAN);
    assert_eq!(mapper.map().len(), 2);
}

/// Two backs of chairs, 20 cm behind each other. Each alone is taken to be as deep as it is wide, so their boxes
/// overlap.
#[test]
fn what_the_detector_sees_as_two_at_once_stays_two() {
    let back = |y: f64, height: f64| upright([0.0, y, 0.5 * height], 0.0, [0.5, 0.05, height]);
    let scene = room(vec![back(2.0, 0.7), back(2.2, 1.0)], &[]);
    let count = |labels: fn(usize) -> &'static [(usize, &'static str)]| {
        let mut mapper = mapper();
        for step in 0..20 {
            let pose = near([0.0, 0.2, 1.3], step, [0.0, 2.1, 0.5]);
            show(&mut mapper, &scene, (0.1 * step as f64, pose), labels(step), &Walls(vec![]));
        }
        boxes(&mapper).len()
    };
    assert_eq!(count(|_| &[(0, "chair"), (1, "chair")]), 2);
    // What is never seen as two may be one thing, found in two places.
    assert_eq!(count(|step| if step % 2 == 0 { &[(0, "chair")] } else { &[(1, "chair")] }), 1);
}

/// The part of a chair that a cupboard does not hide, and later the chair from the other sides: the part is
/// hardly a tenth of the chair, so the boxes' intersection over union says little.
#[test]
fn what_is_found_within_a_thing_of_its_kind_is_a_part_of_it() {
    let planes = Walls(vec![]);
    let (part, whole) = (upright([0.16, 2.5, 0.38], 0.0, [0.14, 0.28, 0.76]), chair(0.0, 2.6));
    let mut mapper = mapper();
    for step in 0..4 {
        let pose = near([0.6, 0.4, 1.2], step, [0.16, 2.5, 0.4]);
        show(&mut mapper, &room(vec![part], &[]), (0.1 * step as f64, pose), &[(0, "chair")], &planes);
    }
    assert_eq!(mapper.map().len(), 1);
    for step in 0..40 {
        let from = if step < 12 { [-0.9, 4.6, 1.2] } else { [2.6, 2.4, 1.2] };
        let pose = near(from, step, [0.0, 2.6, 0.4]);
        show(&mut mapper, &room(vec![whole], &[]), (9.0 + 0.1 * step as f64, pose), &[(0, "chair")], &planes);
    }
    assert_eq!(mapper.map().len(), 1, "{:?}", boxes(&mapper));
    assert!(boxes(&mapper)[0].iou(&whole) > 0.6, "{:?}", boxes(&mapper));
}

/// Of two such backs, one turns out to be a chair that was known from elsewhere.
#[test]
fn what_was_seen_as_two_stays_two_when_one_of_them_goes_into_a_third() {
    let back = |y: f64, height: f64| upright([0.0, y, 0.5 * height], 0.0, [0.5, 0.05, height]);
    let scene = room(vec![back(2.0, 0.7), back(2.2, 1.0), back(8.0, 1.0)], &[]);
    let mut mapper = mapper();
    let show_at = |mapper: &mut ObjectMapper, time: usize, y: f64, labels: &[(usize, &str)]| {
        let pose = near([0.0, y - 1.8, 1.3], time, [0.0, y + 0.1, 0.5]);
        show(mapper, &scene, (0.1 * time as f64, pose), labels, &Walls(vec![]))
    };
    (0..25).for_each(|time| drop(show_at(&mut mapper, time, 8.0, &[(2, "chair")])));
    (25..37).for_each(|time| drop(show_at(&mut mapper, time, 2.0, &[(0, "chair"), (1, "chair")])));
    let ids: Vec<ObjectId> = mapper.map().objects().map(MapObject::id).collect();
    let [known, first, second] = ids[..] else { panic!("{ids:?}") };
    // It comes to stand behind both, so that at first it overlaps with the second alone.
    let center = |id: ObjectId| mapper.map().object(id).unwrap().oriented_box().center();
    let (from, to) = (center(known), center(second));
    let motion = Pose::new([to[0] - from[0], to[1] + 0.2 - from[1], to[2] - from[2]], [0.0, 0.0, 0.0, 1.0]);
    mapper.move_object(known, &motion.unwrap()).unwrap();
    let mut merges = Vec::new();
    for time in 37..45 {
        let merged = show_at(&mut mapper, time, 2.0, &[(1, "chair")]).merged;
        merges.extend(merged.iter().map(|merge| (merge.kept, merge.removed)));
    }
    assert_eq!(merges, [(known, second)]);
    assert!(mapper.map().object(first).is_some_and(|object| object.id() == first));
}

/// The end of a couch beside a cupboard: its box is what couches usually are. From beside the cupboard the
/// couch is seen.
#[test]
fn what_hardly_looks_out_from_behind_something_is_not_confirmed() {
    let couch = upright([0.0, 4.0, 0.4], 0.0, [2.0, 0.9, 0.8]);
    let cupboard = upright([-1.2, 2.5, 1.0], 0.0, [3.6, 0.3, 2.0]);
    let (scene, mut mapper) = (room(vec![couch, cupboard], &[6.0]), mapper());
    let mut look = |step: usize, x: f64| {
        let pose = near([x, 0.0, 1.2], step, [x, 4.0, 0.4]);
        show(&mut mapper, &scene, (0.1 * step as f64, pose), &[(0, "couch")], &Walls(vec![6.0]));
        (mapper.map().len(), mapper.map().candidates().count())
    };
    (0..8).for_each(|step| assert_eq!(look(step, 0.0), (0, 1), "step {step}"));
    let last = (8..24).map(|step| look(step, 1.6)).last();
    assert_eq!(last, Some((1, 0)));
    assert!(boxes(&mapper)[0].iou(&couch) > 0.6, "{:?}", boxes(&mapper));
}

//! Detections of things whose place is known exactly.
use crate::common::{Scene, TABLE, looking, mapper, planes, upright};
use dymlm_core::{ColorImage, DepthImage, Detection, Frame, Pose};
use dymlm_objects::{BoxAxes, NoPlanes, ObjectObservation, ObjectView, Relief, SideView};

fn parameterize(view: &ObjectView<'_>) -> Vec<ObjectObservation> {
    let mut mapper = mapper();
    mapper.insert(view, &planes).unwrap();
    mapper.observations().to_vec()
}

/// A microwave on the table.
fn microwave() -> Scene {
    Scene::new(vec![upright([0.1, 0.3, 0.15], 0.3, [0.5, 0.36, 0.3])])
}

fn pose() -> Pose {
    looking([0.0, -1.2, 0.7], 0.35)
}

#[test]
fn a_thing_on_a_table_is_measured() {
    let (scene, pose) = (microwave(), pose());
    let (frame, detections) = (scene.frame(0.0, &pose), [scene.detection(&pose, 0, "microwave")]);
    let observations = parameterize(&ObjectView::new(&frame, &detections, &pose));
    let [observation] = &observations[..] else { panic!("{} observations", observations.len()) };
    assert_eq!(observation.support.unwrap().id, Some(TABLE));
    assert!(!observation.completeness.is_partial(), "{:?}", observation.completeness);
    assert_eq!(observation.fit.axes.pose(), dymlm_objects::UprightPose::Upright);
    // The far side is not seen, but its upper edge is.
    let iou = observation.fit.oriented_box.iou(&scene.boxes[0]);
    assert!(iou > 0.85, "{iou}: {:?}", observation.fit.oriented_box);
    assert!(observation.points.len() > 300);
}

#[test]
fn without_planes_the_table_may_not_spoil_it_by_much() {
    let (scene, pose) = (microwave(), pose());
    let (frame, detections) = (scene.frame(0.0, &pose), [scene.detection(&pose, 0, "microwave")]);
    let view = ObjectView::new(&frame, &detections, &pose);
    let mut mapper = mapper();
    mapper.insert(&view, &NoPlanes).unwrap();
    assert!(mapper.observations()[0].support.is_none());
    assert!(matches!(mapper.observations()[0].fit.axes, BoxAxes::Principal | BoxAxes::Rectangle));
    // Once the vertical is known, the table is found as a level patch around the thing.
    mapper.insert(&view, &planes).unwrap();
    mapper.insert(&view, &NoPlanes).unwrap();
    let observation = &mapper.observations()[0];
    let support = observation.support.unwrap();
    assert!(support.id.is_none() && support.plane.signed_distance([0.0; 3]).abs() < 0.01, "{support:?}");
    assert!(observation.fit.oriented_box.iou(&scene.boxes[0]) > 0.85);
}

/// A magazine of 4 mm on the table, in a colour, on wood under uneven light.
fn magazine(color: [u8; 3]) -> (Scene, Frame) {
    let scene = Scene::new(vec![upright([0.05, 0.2, 0.002], 0.4, [0.3, 0.2, 0.004])]);
    let frame = scene.frame(0.0, &pose());
    let wood = |pixel: usize| {
        [170, 120, 70].map(|channel| channel + (pixel * 7919 % 23) as u8 + (pixel % 320 / 16) as u8)
    };
    let shown = scene.view(&pose()).shown;
    let colors = shown
        .iter()
        .enumerate()
        .map(|(pixel, own)| if own.is_some() { color } else { wood(pixel) })
        .collect();
    let colors = ColorImage::new(320, 240, colors).unwrap();
    let frame = Frame::new(0.0, scene.camera, frame.depth().clone(), Some(colors)).unwrap();
    (scene, frame)
}

#[test]
fn a_magazine_is_told_from_the_table_by_its_colors() {
    let (scene, frame) = magazine([110, 60, 140]);
    let detections = [scene.detection(&pose(), 0, "book")];
    let observations = parameterize(&ObjectView::new(&frame, &detections, &pose()));
    let [observation] = &observations[..] else { panic!("{} observations", observations.len()) };
    assert_eq!((observation.relief, observation.support.unwrap().id), (Relief::Flat, Some(TABLE)));
    let (own, truth) = (observation.fit.oriented_box, scene.boxes[0]);
    let from_above = |own: &dymlm_geometry::OrientedBox| upright_footprint(own);
    assert!(from_above(&own).iou(&from_above(&truth)) > 0.8, "{own:?}");
    assert!((own.center()[2] - 0.5 * own.lengths()[2]).abs() < 1e-9 && own.lengths()[2] < 0.03, "{own:?}");
}

/// The same footprint, a metre high.
fn upright_footprint(own: &dymlm_geometry::OrientedBox) -> dymlm_geometry::OrientedBox {
    let [x, y, _] = own.center();
    let [length, width, _] = own.lengths();
    let place = Pose::new([x, y, 0.0], own.world_from_box().quaternion()).unwrap();
    dymlm_geometry::OrientedBox::new(place, [length, width, 1.0]).unwrap()
}

#[test]
fn without_colors_the_whole_box_is_the_flat_thing_and_of_one_color_none() {
    let (scene, colored) = magazine([110, 60, 140]);
    let detections = [scene.detection(&pose(), 0, "book")];
    let frame = Frame::new(0.0, scene.camera, colored.depth().clone(), None).unwrap();
    let observations = parameterize(&ObjectView::new(&frame, &detections, &pose()));
    let [observation] = &observations[..] else { panic!("{} observations", observations.len()) };
    assert_eq!(observation.relief, Relief::Flat);
    let (own, truth) = (upright_footprint(&observation.fit.oriented_box), upright_footprint(&scene.boxes[0]));
    assert!(own.intersection_volume(&truth) > 0.9 * truth.volume(), "{own:?}");

    let (_, wooden) = magazine([180, 130, 80]);
    assert!(parameterize(&ObjectView::new(&wooden, &detections, &pose())).is_empty());
    // What is never so flat is not looked for on the table.
    let detections = [scene.detection(&pose(), 0, "bottle")];
    assert!(parameterize(&ObjectView::new(&colored, &detections, &pose())).is_empty());
}

#[test]
fn what_is_seen_behind_the_edge_of_a_table_does_not_stand_on_it() {
    // The back of a chair, 0.2 m behind the table.
    let scene = Scene::new(vec![upright([0.1, 1.22, -0.25], 0.0, [0.45, 0.04, 0.9])]);
    let pose = pose();
    let (frame, detections) = (scene.frame(0.0, &pose), [scene.detection(&pose, 0, "chair")]);
    let observations = parameterize(&ObjectView::new(&frame, &detections, &pose));
    let [observation] = &observations[..] else { panic!("{} observations", observations.len()) };
    assert_eq!(observation.completeness.bottom, SideView::Occluder, "{:?}", observation.completeness);
    assert!(observation.support.is_none(), "{:?}", observation.support);
}

#[test]
fn a_thing_at_the_border_of_the_image_is_partial() {
    let scene = Scene::new(vec![upright([0.9, 0.3, 0.15], 0.0, [0.5, 0.36, 0.3])]);
    let pose = pose();
    let (frame, detections) = (scene.frame(0.0, &pose), [scene.detection(&pose, 0, "microwave")]);
    let observations = parameterize(&ObjectView::new(&frame, &detections, &pose));
    assert_eq!(observations[0].completeness.right, SideView::ImageBorder);
    assert_eq!(observations[0].completeness.left, SideView::Whole);
}

#[test]
fn what_stands_before_a_thing_is_told_by_kind() {
    // A tall thing covers the microwave's right third.
    let mut scene = microwave();
    scene.boxes.push(upright([0.3, -0.25, 0.3], 0.0, [0.2, 0.05, 0.6]));
    let pose = pose();
    let frame = scene.frame(0.0, &pose);
    let detections = [scene.detection(&pose, 0, "microwave")];
    let hidden = parameterize(&ObjectView::new(&frame, &detections, &pose));
    assert_eq!(hidden[0].completeness.right, SideView::Occluder, "{:?}", hidden[0].completeness);
    // The same pixels masked: a mover.
    let mask = scene.mask_without(&pose, 1);
    let view = ObjectView::new(&frame, &detections, &pose).with_static_mask(&mask).unwrap();
    let behind_mover = parameterize(&view);
    assert_eq!(behind_mover[0].completeness.right, SideView::Mover);
    // What is left of the thing is not mixed with what hides it.
    for observation in [&hidden[0], &behind_mover[0]] {
        let inside = scene.boxes[0].intersection_volume(&observation.fit.oriented_box);
        assert!(inside > 0.9 * observation.fit.oriented_box.volume(), "{:?}", observation.fit);
    }
}

#[test]
fn detections_of_movers_of_low_scores_and_of_nothing_are_passed_over() {
    let (scene, pose) = (microwave(), pose());
    let frame = scene.frame(0.0, &pose);
    let around = scene.image_box(&pose, 0).unwrap();
    let labels = ["person".to_owned()];
    let detections = [
        Detection::new("person", 0.9, around).unwrap(),
        Detection::new("microwave", 0.1, around).unwrap(),
        Detection::new("cup", 0.9, [5.0; 4].try_into().unwrap()).unwrap(),
        Detection::new("cup", 0.9, [-50.0, -50.0, -10.0, -10.0].try_into().unwrap()).unwrap(),
        Detection::new("cup", 0.9, [-1e30, -1e30, 1e30, 1e30].try_into().unwrap()).unwrap(),
    ];
    let view = ObjectView::new(&frame, &detections, &pose).without_labels(&labels);
    let observations = parameterize(&view);
    assert!(observations.iter().all(|observation| observation.detection == 4), "{observations:?}");
}

#[test]
fn a_frame_without_depth_shows_nothing() {
    let (scene, pose) = (microwave(), pose());
    let empty = DepthImage::new(320, 240, vec![f32::NAN; 320 * 240]).unwrap();
    let frame = Frame::new(0.0, scene.camera, empty, None).unwrap();
    let detections = [scene.detection(&pose, 0, "microwave")];
    assert!(parameterize(&ObjectView::new(&frame, &detections, &pose)).is_empty());
}

#[test]
fn the_same_frame_gives_the_same_bits() {
    let (scene, pose) = (microwave(), pose());
    let (frame, detections) = (scene.frame(0.0, &pose), [scene.detection(&pose, 0, "microwave")]);
    let view = ObjectView::new(&frame, &detections, &pose);
    let mut mapper = mapper();
    mapper.insert(&view, &planes).unwrap();
    let again = mapper.observations();
    assert_eq!(again, parameterize(&view));
}

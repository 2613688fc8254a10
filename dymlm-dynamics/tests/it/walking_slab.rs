//! All steps on a scene with exact answers: a slab the shape of a person walks before a wall, beside a box on
//! the floor; the detector misses, and cuts it short.
use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Pose, SensorModel};
use dymlm_dynamics::{
    BoxSource, BoxTracker, DynamicsConfig, Error, MaskMode, Mover, Preprocessor, SceneKnowledge,
};
use dymlm_geometry::OrientedBox;
use proptest::prelude::*;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;

/// A rectangle of one depth: columns, rows, metres.
#[derive(Clone, Copy)]
struct Slab {
    x: [usize; 2],
    y: [usize; 2],
    depth: f32,
}

fn slab(x: [usize; 2], y: [usize; 2], depth: f32) -> Slab {
    Slab { x, y, depth }
}

/// Head, body and two legs, 80 pixels wide from column `left`.
fn person(left: usize, depth: f32) -> [Slab; 4] {
    [
        slab([left + 25, left + 55], [60, 110], depth),
        slab([left, left + 80], [110, 260], depth),
        slab([left + 5, left + 35], [260, 420], depth),
        slab([left + 45, left + 75], [260, 420], depth),
    ]
}

fn boxed(x_min: f32, y_min: f32, x_max: f32, y_max: f32) -> BoundingBox {
    BoundingBox::new(x_min, y_min, x_max, y_max).unwrap()
}

/// The box that just holds [`person`].
fn person_box(left: usize) -> BoundingBox {
    boxed(left as f32, 60.0, left as f32 + 80.0, 420.0)
}

fn detect(bounding_box: BoundingBox) -> Detection {
    Detection::new("person", 0.9, bounding_box).unwrap()
}

/// A wall at 3 m, and before it the slabs, the nearest in front. A depth of 0 punches a hole.
fn render(slabs: &[Slab]) -> DepthImage {
    let mut data = vec![3.0_f32; WIDTH * HEIGHT];
    for slab in slabs {
        for v in slab.y[0]..slab.y[1].min(HEIGHT) {
            for depth in &mut data[v * WIDTH + slab.x[0]..v * WIDTH + slab.x[1].min(WIDTH)] {
                *depth = if slab.depth == 0.0 { 0.0 } else { depth.min(slab.depth) };
            }
        }
    }
    DepthImage::new(WIDTH, HEIGHT, data).unwrap()
}

/// An endless surface that is no plane: folds of 10 cm, 20 pixels wide, along both axes.
fn crumpled(width: usize, height: usize) -> DepthImage {
    let fold = |pixel: usize| (pixel % 40).abs_diff(20) as f32 / 20.0;
    let depth = (0..width * height).map(|i| 2.0 + 0.1 * (fold(i % width) + fold(i / width)));
    DepthImage::new(width, height, depth.collect()).unwrap()
}

fn frame(timestamp: f64, slabs: &[Slab]) -> Frame {
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 319.5, 239.5).unwrap();
    Frame::new(timestamp, camera, render(slabs), None).unwrap()
}

fn preprocessor(change: impl Fn(&mut DynamicsConfig)) -> Preprocessor {
    let mut config = DynamicsConfig::default();
    change(&mut config);
    Preprocessor::new(config, SensorModel::kinect()).unwrap()
}

/// Silhouettes without a rim, so that the mask is exact.
fn bare(config: &mut DynamicsConfig) {
    config.mask.dilation = 0.0;
    config.mask.shadow = 0.0;
}

/// One frame through a new preprocessor.
fn run(change: impl Fn(&mut DynamicsConfig), slabs: &[Slab], detections: &[Detection]) -> (Vec<Mover>, Mask) {
    let mut preprocessor = preprocessor(change);
    let result = preprocessor.process(&frame(0.0, slabs), Some(detections), &Pose::identity()).unwrap();
    (result.movers.to_vec(), result.static_mask.clone())
}

fn is_in(slabs: &[Slab], u: usize, v: usize) -> bool {
    slabs.iter().any(|s| (s.x[0]..s.x[1]).contains(&u) && (s.y[0]..s.y[1]).contains(&v))
}

/// Asserts that just the pixels that `masked` chooses are masked.
fn assert_masks(mask: &Mask, masked: impl Fn(usize, usize) -> bool) {
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            assert_eq!(!mask.at(u, v), masked(u, v), "at pixel ({u}, {v})");
        }
    }
}

#[test]
fn a_silhouette_is_just_the_person() {
    let walker = person(200, 2.0);
    let (movers, mask) = run(bare, &walker, &[detect(person_box(200))]);
    assert_eq!(movers[0].corrected_box, person_box(200));
    assert_eq!(movers[0].depth, Some(2.0));
    assert_masks(&mask, |u, v| is_in(&walker, u, v));
}

#[test]
fn a_box_is_the_whole_box() {
    let boxes = |config: &mut DynamicsConfig| config.mask.mode = MaskMode::Box;
    let (_, mask) = run(boxes, &person(200, 2.0), &[detect(person_box(200))]);
    assert_masks(&mask, |u, v| (200..280).contains(&u) && (60..420).contains(&v));
}

#[test]
fn the_rim_is_as_wide_as_set() {
    let walker = [slab([200, 280], [100, 400], 2.0)];
    let (_, mask) = run(|_| {}, &walker, &[detect(boxed(180.0, 80.0, 300.0, 420.0))]);
    assert!(!mask.at(197, 200) && mask.at(196, 200) && !mask.at(282, 200) && mask.at(283, 200));
    // Where there is no depth it goes on for eight pixels.
    let shadow = slab([280, 300], [100, 400], 0.0);
    let (_, mask) = run(|_| {}, &[walker[0], shadow], &[detect(boxed(180.0, 80.0, 300.0, 420.0))]);
    assert!(!mask.at(287, 200) && mask.at(288, 200) && mask.at(196, 200));
}

#[test]
fn boxes_cut_short_grow_to_the_person() {
    let walker = person(200, 2.0);
    let cut = boxed(221.5, 95.0, 262.25, 390.0);
    let (movers, mask) = run(bare, &walker, &[detect(cut)]);
    assert_eq!(movers[0].bounding_box, cut);
    assert_eq!(movers[0].corrected_box, person_box(200));
    assert_masks(&mask, |u, v| is_in(&walker, u, v));
}

#[test]
fn sides_move_by_no_more_than_allowed_and_never_inward() {
    // A surface without end: only the limit stops it.
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 319.5, 239.5).unwrap();
    let endless = Frame::new(0.0, camera, crumpled(WIDTH, HEIGHT), None).unwrap();
    let corrected = |max_extension: f32, detected: BoundingBox| {
        let mut preprocessor = preprocessor(|config| config.max_extension = max_extension);
        let result = preprocessor.process(&endless, Some(&[detect(detected)]), &Pose::identity());
        result.unwrap().movers[0].corrected_box
    };
    let detected = boxed(200.0, 150.0, 300.0, 300.0);
    assert_eq!(corrected(50.0, detected), boxed(150.0, 100.0, 350.0, 350.0));
    assert_eq!(corrected(7.0, boxed(3.0, 2.0, 300.0, 479.5)), boxed(0.0, 0.0, 307.0, 479.5));
    assert_eq!(corrected(0.0, detected), detected);
    let loose = boxed(150.0, 20.0, 350.0, 470.0);
    let (movers, _) = run(|_| {}, &person(200, 2.0), &[detect(loose)]);
    assert_eq!(movers[0].corrected_box, loose);
}

#[test]
fn the_limit_scales_with_the_image() {
    let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap();
    let frame = Frame::new(0.0, camera, crumpled(320, 240), None).unwrap();
    let mut preprocessor = preprocessor(|_| {});
    let result = preprocessor
        .process(&frame, Some(&[detect(boxed(100.0, 100.0, 150.0, 150.0))]), &Pose::identity())
        .unwrap();
    assert_eq!(result.movers[0].corrected_box, boxed(75.0, 75.0, 175.0, 175.0));
}

#[test]
fn furniture_before_and_beside_a_person_stays() {
    let walker = person(200, 2.0);
    // A chair 30 cm before the legs, going on outside the box, and a cupboard 30 cm behind, at the person's
    // side.
    let chair = slab([150, 250], [330, 480], 1.7);
    let cupboard = slab([280, 400], [200, 480], 2.3);
    let (_, mask) =
        run(bare, &[walker[0], walker[1], walker[2], walker[3], chair, cupboard], &[detect(person_box(200))]);
    assert_masks(&mask, |u, v| is_in(&walker, u, v) && !is_in(&[chair], u, v));
}

#[test]
fn a_person_parted_by_a_bar_is_whole() {
    let walker = person(200, 2.0);
    let bar = slab([100, 400], [200, 215], 1.2);
    let (_, mask) = run(bare, &[walker[0], walker[1], walker[2], walker[3], bar], &[detect(person_box(200))]);
    assert_masks(&mask, |u, v| is_in(&walker, u, v) && !is_in(&[bar], u, v));
}

/// The box ends at a chair's back; below it the legs show between the slats.
#[test]
fn legs_seen_through_a_chair_below_the_box_are_found() {
    let walker = person(200, 2.0);
    let slats = [slab([100, 400], [370, 385], 1.2), slab([100, 400], [397, 407], 1.2)];
    let scene: Vec<Slab> = walker.into_iter().chain(slats).collect();
    let cut = boxed(200.0, 60.0, 280.0, 375.0);
    let (movers, mask) = run(bare, &scene, &[detect(cut)]);
    assert_eq!(movers[0].corrected_box, person_box(200));
    assert_masks(&mask, |u, v| is_in(&walker, u, v) && !is_in(&slats, u, v));
    // Boxes that stay as they are look for nothing around them.
    let uncorrected = |config: &mut DynamicsConfig| {
        bare(config);
        config.max_extension = 0.0;
    };
    let (movers, mask) = run(uncorrected, &scene, &[detect(cut)]);
    assert_eq!(movers[0].corrected_box, cut);
    assert_masks(&mask, |u, v| v < 375 && is_in(&walker, u, v) && !is_in(&slats, u, v));
}

#[test]
fn parts_outside_the_box_do_not_take_it_past_its_limit() {
    let (body, foot) = (slab([200, 280], [60, 300], 2.0), slab([290, 320], [250, 300], 2.1));
    let narrow = |config: &mut DynamicsConfig| {
        bare(config);
        config.max_extension = 20.0;
    };
    let (movers, mask) = run(narrow, &[body, foot], &[detect(boxed(200.0, 60.0, 280.0, 300.0))]);
    assert_eq!(movers[0].corrected_box, boxed(200.0, 60.0, 300.0, 300.0));
    assert_masks(&mask, |u, v| u < 300 && is_in(&[body, foot], u, v));
}

#[test]
fn a_forearm_before_the_body_belongs_to_it() {
    let (body, forearm) = (slab([200, 280], [60, 420], 2.0), slab([160, 190], [150, 200], 1.7));
    let (_, mask) = run(bare, &[body, forearm], &[detect(boxed(150.0, 60.0, 280.0, 420.0))]);
    assert_masks(&mask, |u, v| is_in(&[body, forearm], u, v));
    // What goes on outside is furniture: the same depth, but past the margin.
    let rail = slab([20, 190], [150, 200], 1.7);
    let (_, mask) = run(bare, &[body, rail], &[detect(boxed(150.0, 60.0, 280.0, 420.0))]);
    assert_masks(&mask, |u, v| is_in(&[body], u, v));
}

/// Most of the box, and its middle, is wall.
#[test]
fn the_wall_is_nobody_however_much_of_the_box_it_fills() {
    let walker = slab([100, 160], [60, 420], 2.0);
    let (movers, mask) = run(bare, &[walker], &[detect(boxed(100.0, 60.0, 300.0, 420.0))]);
    assert_eq!(movers[0].depth, Some(2.0));
    assert_masks(&mask, |u, v| is_in(&[walker], u, v));
}

#[test]
fn two_people_one_before_the_other() {
    let (near, far) = (person(200, 1.5), person(250, 2.2));
    let slabs: Vec<Slab> = far.into_iter().chain(near).collect();
    let (movers, mask) = run(bare, &slabs, &[detect(person_box(250)), detect(person_box(200))]);
    let depth_of = |left: f32| movers.iter().find(|m| m.bounding_box.x_min() == left).unwrap().depth;
    assert_eq!((depth_of(200.0), depth_of(250.0)), (Some(1.5), Some(2.2)));
    assert_masks(&mask, |u, v| is_in(&slabs, u, v));
}

/// Who sits before somebody fills a good part of the latter's box, and is nearer.
#[test]
fn who_reaches_into_a_box_is_not_the_one_in_it() {
    let (near, far) = (slab([181, 285], [60, 420], 1.5), slab([240, 360], [60, 420], 2.2));
    let boxes = [boxed(181.0, 60.0, 285.0, 420.0), boxed(230.0, 60.0, 360.0, 420.0)];
    let (movers, mask) = run(bare, &[near, far], &boxes.map(detect));
    let depth_of = |own: BoundingBox| movers.iter().find(|mover| mover.bounding_box == own).unwrap().depth;
    assert_eq!(boxes.map(depth_of), [Some(1.5), Some(2.2)]);
    assert_masks(&mask, |u, v| is_in(&[near, far], u, v));
}

/// Somebody passes before who sits there, whom the detector misses as soon as they show again.
#[test]
fn who_was_hidden_by_another_is_still_expected_at_their_own_depth() {
    let (sitter, passer) = (person(240, 2.5), slab([200, 360], [20, 480], 1.2));
    let behind: Vec<Slab> = sitter.into_iter().chain([passer]).collect();
    let both = [detect(person_box(240)), detect(boxed(200.0, 20.0, 360.0, 480.0))];
    let mut preprocessor = preprocessor(bare);
    let mut masks = |time: f64, slabs: &[Slab], found: &[Detection]| {
        let result = preprocessor.process(&frame(time, slabs), Some(found), &Pose::identity()).unwrap();
        result.static_mask.clone()
    };
    for time in [0.0, 0.1, 0.2] {
        masks(time, &sitter, &both[..1]);
    }
    let mask = masks(0.3, &behind, &both);
    assert_masks(&mask, |u, v| is_in(&[passer], u, v));
    let mask = masks(0.4, &sitter, &[]);
    assert_masks(&mask, |u, v| is_in(&sitter, u, v));
}

#[test]
fn who_is_cut_by_the_image_is_not_the_cabinet_in_the_middle_of_the_box() {
    let (cut, cabinet) = (slab([590, WIDTH], [60, 470], 2.0), slab([450, 570], [60, 470], 2.9));
    let (movers, mask) = run(bare, &[cut, cabinet], &[detect(boxed(440.0, 60.0, 640.0, 470.0))]);
    assert_eq!(movers[0].depth, Some(2.0));
    assert_masks(&mask, |u, v| is_in(&[cut], u, v));
}

#[test]
fn feet_beyond_a_chair_belong_to_who_sits_on_it() {
    let back = slab([200, 300], [60, 300], 1.5);
    let feet = [slab([210, 235], [370, 400], 2.2), slab([260, 285], [370, 400], 2.2)];
    let (_, mask) = run(bare, &[back, feet[0], feet[1]], &[detect(boxed(200.0, 60.0, 300.0, 400.0))]);
    assert_masks(&mask, |u, v| is_in(&[back, feet[0], feet[1]], u, v));
}

#[test]
fn what_stands_as_far_behind_as_feet_and_mostly_beside_the_box_stays() {
    let (body, laptop) = (slab([200, 300], [60, 420], 1.5), slab([290, 335], [200, 235], 2.2));
    let (_, mask) = run(bare, &[body, laptop], &[detect(boxed(200.0, 60.0, 305.0, 420.0))]);
    assert_masks(&mask, |u, v| is_in(&[body], u, v));
}

#[test]
fn who_is_seen_above_and_below_a_screen_is_not_the_screen() {
    let (head, legs) = (slab([225, 275], [60, 130], 2.2), slab([215, 285], [330, 420], 2.2));
    let screen = slab([190, 310], [130, 260], 1.5);
    let desk = slab([80, 420], [260, 330], 1.7);
    let (_, mask) = run(bare, &[head, legs, screen, desk], &[detect(boxed(215.0, 62.0, 287.0, 420.0))]);
    assert_masks(&mask, |u, v| is_in(&[head, legs], u, v));
}

#[test]
fn specks_in_the_corners_of_a_box_are_nobody() {
    let walker = slab([230, 300], [100, 400], 2.0);
    let specks = [slab([200, 212], [82, 94], 1.2), slab([338, 350], [428, 440], 1.2)];
    let (_, mask) = run(bare, &[walker, specks[0], specks[1]], &[detect(boxed(200.0, 80.0, 350.0, 440.0))]);
    assert_masks(&mask, |u, v| is_in(&[walker], u, v));
}

#[test]
fn a_person_cut_by_the_image_and_partly_without_depth() {
    // The left border of the image has no depth, as after registration of a Kinect's depth to its colour.
    let walker = [slab([0, 60], [40, HEIGHT], 1.2)];
    let border = slab([0, 25], [0, HEIGHT], 0.0);
    let (movers, mask) = run(bare, &[walker[0], border], &[detect(boxed(-5.0, 38.0, 50.0, 480.0))]);
    assert_eq!(movers[0].corrected_box.x_max(), 60.0);
    assert_masks(&mask, |u, v| u >= 25 && is_in(&walker, u, v));
}

#[test]
fn a_given_mask_seeds_the_foreground() {
    // Two people at one depth, in one box; the instance mask says which one is meant, but for its edge.
    let (meant, other) = (slab([200, 260], [100, 400], 2.0), slab([300, 360], [100, 400], 2.0));
    let mut instance = Mask::filled(WIDTH, HEIGHT, false).unwrap();
    for v in 110..390 {
        instance.fill_row(v, 205..255, true);
    }
    let detection = detect(boxed(190.0, 90.0, 370.0, 410.0)).with_mask(instance);
    let (_, mask) = run(bare, &[meant, other], &[detection]);
    assert_masks(&mask, |u, v| is_in(&[meant], u, v));
}

/// Walks 6 pixels a frame; the detector misses frames 5 to 7.
#[test]
fn missed_detections_are_bridged() {
    for max_coast in [0.5, 0.0] {
        let mut preprocessor = preprocessor(|config| {
            bare(config);
            config.tracker.max_coast = max_coast;
        });
        for step in 0..10 {
            let walker = person(200 + 6 * step, 2.0);
            let missed = (5..8).contains(&step);
            let detections = [detect(person_box(200 + 6 * step))];
            let detections = if missed { &[][..] } else { &detections[..] };
            let result = preprocessor
                .process(&frame(step as f64 / 10.0, &walker), Some(detections), &Pose::identity())
                .unwrap();
            if missed && max_coast == 0.0 {
                assert!(result.movers.is_empty());
                assert_eq!(result.static_mask.count(), WIDTH * HEIGHT);
            } else {
                assert_eq!((result.movers.len(), result.movers[0].track_id.get()), (1, 0));
                assert_eq!(matches!(result.movers[0].source, BoxSource::Predicted { .. }), missed);
                assert_masks(result.static_mask, |u, v| is_in(&walker, u, v));
            }
        }
    }
}

/// The person steps out of sight: what is predicted holds the wall only.
#[test]
fn nobody_is_nobody() {
    let mut preprocessor = preprocessor(|_| {});
    for step in 0..4 {
        preprocessor
            .process(
                &frame(f64::from(step) / 10.0, &person(200, 2.0)),
                Some(&[detect(person_box(200))]),
                &Pose::identity(),
            )
            .unwrap();
    }
    let result = preprocessor.process(&frame(0.4, &[]), Some(&[]), &Pose::identity()).unwrap();
    assert!(result.movers.is_empty());
    assert_eq!(result.static_mask.count(), WIDTH * HEIGHT);
}

#[test]
fn a_detection_masks_in_its_first_frame_whatever_its_depth() {
    // Nothing in the box has a depth: all of it goes, so that colour without depth goes too.
    let hole = [slab([0, WIDTH], [0, HEIGHT], 0.0)];
    let (movers, mask) = run(|_| {}, &hole, &[detect(person_box(200))]);
    assert_eq!((movers[0].depth, movers[0].corrected_box), (None, person_box(200)));
    assert_masks(&mask, |u, v| (200..280).contains(&u) && (60..420).contains(&v));
}

#[test]
fn only_labels_of_movers_are_movers() {
    let chair = Detection::new("chair", 0.9, person_box(200)).unwrap();
    let dog = Detection::new("dog", 0.9, person_box(200)).unwrap();
    let (movers, mask) = run(|_| {}, &person(200, 2.0), std::slice::from_ref(&chair));
    assert!(movers.is_empty() && mask.count() == WIDTH * HEIGHT);
    let (movers, _) = run(|_| {}, &person(200, 2.0), &[chair.clone(), dog.clone()]);
    assert_eq!((movers.len(), movers[0].label.as_deref()), (1, Some("dog")));
    assert_eq!(movers[0].source, BoxSource::Detected { detection: 1 });
    let chairs = |config: &mut DynamicsConfig| config.mover_labels = vec!["chair".into()];
    let (movers, _) = run(chairs, &person(200, 2.0), &[chair, dog]);
    let labels: Vec<_> = movers.iter().map(|mover| mover.label.as_deref()).collect();
    assert_eq!(labels, [Some("chair"), Some("dog")]);
}

#[test]
fn odd_boxes_mask_what_they_cover() {
    let odd = [
        boxed(700.0, 500.0, 800.0, 600.0),
        boxed(-90.0, -90.0, -10.0, -10.0),
        boxed(50.0, 50.0, 50.0, 90.0),
        boxed(20.2, 20.2, 20.8, 20.8),
        boxed(-1e38, -1e38, 1e38, -1e37),
    ];
    let (_, mask) = run(|_| {}, &person(200, 2.0), &odd.map(detect));
    assert_eq!(mask.count(), WIDTH * HEIGHT);
    let (_, mask) = run(bare, &person(200, 2.0), &[]);
    assert_eq!(mask.count(), WIDTH * HEIGHT);
    // All of the image, and far beyond.
    let (_, mask) = run(
        |config| config.mask.mode = MaskMode::Box,
        &person(200, 2.0),
        &[detect(boxed(-1e30, -1e30, 1e30, 1e30))],
    );
    assert_eq!(mask.count(), 0);
}

#[test]
fn tiny_images_are_images() {
    for (width, height) in [(1, 1), (2, 1), (3, 7), (16, 12)] {
        let camera = PinholeCamera::new(width, height, 10.0, 10.0, 0.0, 0.0).unwrap();
        let depth = DepthImage::new(width, height, vec![2.0; width * height]).unwrap();
        let frame = Frame::new(0.0, camera, depth, None).unwrap();
        let mut preprocessor = preprocessor(|_| {});
        let result = preprocessor
            .process(&frame, Some(&[detect(boxed(0.0, 0.0, 99.0, 99.0))]), &Pose::identity())
            .unwrap();
        assert_eq!(result.static_mask.count(), 0);
    }
}

#[test]
fn refused_frames_change_nothing() {
    let mut preprocessor = preprocessor(|_| {});
    let walker = person(200, 2.0);
    preprocessor.process(&frame(1.0, &walker), Some(&[detect(person_box(200))]), &Pose::identity()).unwrap();
    let before = format!("{preprocessor:?}");
    let small = detect(person_box(200)).with_mask(Mask::filled(2, 2, true).unwrap());
    assert_eq!(
        preprocessor.process(&frame(1.1, &walker), Some(&[small]), &Pose::identity()).unwrap_err(),
        Error::InstanceMaskSize { detection: 0, width: 640, height: 480, actual_width: 2, actual_height: 2 }
    );
    assert!(preprocessor.process(&frame(0.9, &walker), Some(&[]), &Pose::identity()).is_err());
    assert_eq!(format!("{preprocessor:?}"), before);
}

#[test]
fn settings_are_checked() {
    type Change = fn(&mut DynamicsConfig);
    let changes: [(&str, Change); 8] = [
        ("dynamics.max_extension", |config| config.max_extension = f32::NAN),
        ("dynamics.mask.dilation", |config| config.mask.dilation = -1.0),
        ("dynamics.mask.shadow", |config| config.mask.shadow = 65.0),
        ("dynamics.tracker.high_score", |config| config.tracker.high_score = 1.1),
        ("dynamics.tracker.min_score", |config| config.tracker.min_score = -0.1),
        ("dynamics.tracker.confirm_after", |config| config.tracker.confirm_after = f64::INFINITY),
        ("dynamics.tracker.max_coast", |config| config.tracker.max_coast = -1.0),
        ("dynamics.tracker.max_age", |config| config.tracker.max_age = 1e9),
    ];
    for (path, change) in changes {
        let mut config = DynamicsConfig::default();
        change(&mut config);
        match Preprocessor::new(config, SensorModel::kinect()) {
            Err(Error::Config(error)) => assert_eq!(error.field, path),
            other => panic!("{path}: {other:?}"),
        }
    }
}

#[test]
fn a_mover_label_adds_to_the_usual_ones_and_must_be_known() {
    let labels = |change: fn(&mut DynamicsConfig)| {
        let mut config = DynamicsConfig::default();
        change(&mut config);
        Preprocessor::new(config, SensorModel::kinect()).map(|made| made.mover_labels().to_vec())
    };
    let added = labels(|config| config.mover_labels = vec!["car".into()]).unwrap();
    assert!(added.contains(&"person".to_owned()) && added.contains(&"car".to_owned()));
    let own = labels(|config| config.own_mover_labels = vec!["forklift".into()]).unwrap();
    assert!(own.contains(&"person".to_owned()) && own.contains(&"forklift".to_owned()));
    let misspelt = labels(|config| config.mover_labels = vec!["bycicle".into()]).unwrap_err();
    assert_eq!(misspelt, Error::UnknownLabel { label: "bycicle".into(), nearest: "bicycle" });
    assert!(
        misspelt
            .to_string()
            .starts_with("dynamics.mover_labels: \"bycicle\" is no class of COCO; is \"bicycle\"")
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Boxes anywhere, over people anywhere: whatever the order of the detections, the mask is the same, a
    /// second run gives the same bits, sides never move inward, and silhouettes stay within the corrected
    /// boxes.
    #[test]
    fn masks_are_determined(
        people in proptest::collection::vec((0_usize..560, 0.6_f32..2.9), 0..4),
        boxes in proptest::collection::vec([-50_i16..640, -50_i16..480, 1_i16..300, 1_i16..300], 0..5),
        holes in proptest::collection::vec([0_usize..600, 0_usize..440], 0..6),
    ) {
        let mut slabs: Vec<Slab> = people.iter().flat_map(|&(left, depth)| person(left, depth)).collect();
        slabs.extend(holes.iter().map(|&[x, y]| slab([x, x + 40], [y, y + 40], 0.0)));
        let detections: Vec<Detection> = boxes
            .iter()
            .map(|&[x, y, width, height]| {
                let [x, y, width, height] = [x, y, width, height].map(f32::from);
                detect(boxed(x, y, x + width, y + height))
            })
            .collect();
        let (movers, mask) = run(|_| {}, &slabs, &detections);
        let reversed: Vec<Detection> = detections.iter().rev().cloned().collect();
        prop_assert_eq!(&run(|_| {}, &slabs, &reversed).1, &mask);
        prop_assert_eq!(&run(|_| {}, &slabs, &detections).1, &mask);
        for mover in &movers {
            let [a, b] = [mover.bounding_box, mover.corrected_box].map(<[f32; 4]>::from);
            prop_assert!(b[0] <= a[0] && b[1] <= a[1] && b[2] >= a[2] && b[3] >= a[3]);
        }
        let (_, box_mask) = run(|config| config.mask.mode = MaskMode::Box, &slabs, &detections);
        for (silhouette, whole) in mask.pixels().zip(box_mask.pixels()) {
            prop_assert!(silhouette || !whole);
        }
    }
}

/// 110 degrees of view: a pixel is three times as wide as a Kinect's.
#[test]
fn a_wide_angle_camera_sees_the_same_person() {
    let (width, height, focal) = (640, 480, 185.0_f32);
    let camera = PinholeCamera::new(width, height, focal.into(), focal.into(), 319.5, 239.5).unwrap();
    // A cylinder of 25 cm before a wall at 3 m, its axis at 2 m.
    let surface = |u: f32| {
        let across = (u - 319.5) / focal;
        let (a, b, c) = (1.0 + across * across, -4.0, 4.0 - 0.0625);
        let discriminant: f32 = b * b - 4.0 * a * c;
        if discriminant < 0.0 { 3.0 } else { (-b - discriminant.sqrt()) / (2.0 * a) }
    };
    let pixel = |i: usize| if (150..330).contains(&(i / width)) { surface((i % width) as f32) } else { 3.0 };
    let depth = DepthImage::new(width, height, (0..width * height).map(pixel).collect()).unwrap();
    let person = |i: usize| depth.data()[i] < 3.0;
    let frame = Frame::new(0.0, camera, depth.clone(), None).unwrap();
    let mut preprocessor = preprocessor(bare);
    let detection = detect(boxed(290.0, 145.0, 349.0, 335.0));
    let result = preprocessor.process(&frame, Some(&[detection]), &Pose::identity()).unwrap();
    assert!((result.movers[0].depth.unwrap() - 1.77).abs() < 0.05, "{:?}", result.movers[0].depth);
    assert_masks(result.static_mask, |u, v| person(v * width + u));
}

/// The same at every frame rate: 60 Hz with a gap of 0.4 s, and 1 Hz with one frame missed.
#[test]
fn misses_are_bridged_at_every_frame_rate() {
    for (rate, frames, missed, speed) in [
        (60.0, 60, 30..54, 1),
        (10.0, 12, 6..9, 4),
        (1.0, 6, 4..5, 5),
        (1.0, 5, 3..4, 80),
        (0.998, 5, 3..4, 80),
        (0.5, 5, 3..4, 80),
    ] {
        let mut preprocessor = preprocessor(bare);
        for step in 0..frames {
            let walker = person(200 + speed * step, 2.0);
            let detections = [detect(person_box(200 + speed * step))];
            let detections = if missed.contains(&step) { &[][..] } else { &detections[..] };
            let frame = frame(step as f64 / rate, &walker);
            let result = preprocessor.process(&frame, Some(detections), &Pose::identity()).unwrap();
            assert_masks(result.static_mask, |u, v| is_in(&walker, u, v));
        }
    }
}

/// A detector at a third of the camera's rate: whoever it saw once is masked until it looks again, then no
/// longer.
#[test]
fn frames_without_a_detector_s_run_are_no_misses() {
    let mut preprocessor = preprocessor(bare);
    for step in 0..30 {
        let walker = person(200 + 3 * step, 2.0);
        let found = [detect(person_box(200 + 3 * step))];
        let detections = (step % 3 == 0).then_some(&found[..]);
        let frame = frame(step as f64 / 30.0, &walker);
        let result = preprocessor.process(&frame, detections, &Pose::identity()).unwrap();
        assert_eq!(result.movers.len(), 1, "at step {step}");
        assert_masks(result.static_mask, |u, v| is_in(&walker, u, v));
    }
}

#[test]
fn a_detector_that_runs_no_more_is_believed_for_a_second() {
    let mut preprocessor = preprocessor(bare);
    let walker = person(200, 2.0);
    let found = [detect(person_box(200))];
    let mut masked = |time: f64, detections: Option<&[Detection]>| {
        let result = preprocessor.process(&frame(time, &walker), detections, &Pose::identity()).unwrap();
        result.static_mask.count() < WIDTH * HEIGHT
    };
    assert!(masked(0.0, Some(&found)) && masked(0.1, Some(&found)));
    assert!(masked(0.6, None) && masked(1.1, None) && !masked(1.2, None));
}

#[test]
fn all_carried_bodies_are_masked() {
    let body = |x: f64| {
        let pose = Pose::new([x, 0.0, 2.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        OrientedBox::new(pose, [0.2, 0.2, 0.2]).unwrap()
    };
    let things = [slab([170, 190], [230, 250], 2.0), slab([450, 470], [230, 250], 2.0)];
    // The camera stands elsewhere: bodies are given in the world.
    let world_from_camera = Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let bodies = [body(0.467), body(1.535)];
    let knowledge = SceneKnowledge::default().with_carried(&bodies);
    let mut preprocessor = preprocessor(bare);
    let result = preprocessor
        .process_knowing(&frame(0.0, &things), Some(&[]), &world_from_camera, &knowledge)
        .unwrap();
    assert_masks(result.static_mask, |u, v| is_in(&things, u, v));
}

#[test]
fn the_preprocessor_can_be_sent_to_a_thread() {
    fn shared<T: Send + Sync>() {}
    shared::<Preprocessor>();
    shared::<BoxTracker>();
}

/// A second between frames, in which boxes come to lie beside those before, and the detector misses one: who
/// walks away is masked, not the stool that they pass.
#[test]
fn at_one_hertz_the_stool_beside_who_walks_away_stays() {
    for (speed, away) in [(30, 0.33_f32), (60, 0.3), (60, 0.0), (90, 0.2), (100, -0.1)] {
        for missed in 3..6 {
            let left = |step: usize| 60 + speed * step;
            let depth = |step: usize| 1.3 + away * step as f32;
            let beside = left(missed) + 40;
            let stool = [slab([beside, beside + 60], [330, 420], depth(missed) - 0.45)];
            let mut preprocessor = preprocessor(bare);
            let mut mask = None;
            for step in 0..=missed {
                let slabs: Vec<Slab> = person(left(step), depth(step)).into_iter().chain(stool).collect();
                let found = [detect(person_box(left(step)))];
                let found = if step == missed { &[][..] } else { &found[..] };
                let frame = frame(step as f64, &slabs);
                let result = preprocessor.process(&frame, Some(found), &Pose::identity()).unwrap();
                mask = Some(result.static_mask.clone());
            }
            let (mask, walker) = (mask.unwrap(), person(left(missed), depth(missed)));
            let pixels = (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (u, v)));
            let (stool_pixels, others): (Vec<_>, Vec<_>) = pixels.partition(|&(u, v)| is_in(&stool, u, v));
            let masked = |pixels: &[(usize, usize)]| pixels.iter().filter(|&&(u, v)| !mask.at(u, v)).count();
            let person: Vec<_> = others.into_iter().filter(|&(u, v)| is_in(&walker, u, v)).collect();
            assert_eq!(masked(&stool_pixels), 0, "{speed} px a second, {away} m, frame {missed}");
            assert!(masked(&person) * 10 >= person.len() * 9, "{} of {}", masked(&person), person.len());
        }
    }
}

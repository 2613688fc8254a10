//! Corners and optical flow on images with known warps.

use dymlm_core::{BoundingBox, Mask};
use dymlm_tracking::{
    CornerConfig, CornerDetector, FlowConfig, FlowStatus, GrayImage, ImagePyramid, Lighting, OpticalFlow,
};
use proptest::prelude::*;

const WIDTH: usize = 200;
const HEIGHT: usize = 160;

/// A sum of waves in many directions: smooth, and different everywhere.
fn waves(u: f32, v: f32) -> f32 {
    (0..12)
        .map(|k| {
            let k = k as f32;
            let (sin, cos) = (0.7 * k + 0.3 * k * k).sin_cos();
            let frequency = 0.09 + 0.05 * k;
            0.06 * (frequency * (cos * u + sin * v) + 1.3 * k).sin()
        })
        .sum::<f32>()
        + 0.5
}

/// The image in which the content of p is at c + zoom R(turn) (p - c) + shift.
fn image(shift: [f32; 2], turn: f32, zoom: f32, gain: f32) -> GrayImage {
    let (sin, cos) = turn.sin_cos();
    let value = |i: usize| {
        let (x, y) = ((i % WIDTH) as f32 - 100.0 - shift[0], (i / WIDTH) as f32 - 80.0 - shift[1]);
        gain * waves((cos * x + sin * y) / zoom + 100.0, (cos * y - sin * x) / zoom + 80.0)
    };
    GrayImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(value).collect()).unwrap()
}

fn moved(p: [f32; 2], shift: [f32; 2], turn: f32, zoom: f32) -> [f32; 2] {
    let (sin, cos) = turn.sin_cos();
    let (x, y) = (p[0] - 100.0, p[1] - 80.0);
    [100.0 + zoom * (cos * x - sin * y) + shift[0], 80.0 + zoom * (sin * x + cos * y) + shift[1]]
}

fn grid() -> Vec<[f32; 2]> {
    (0..48).map(|i| [50.3 + 13.0 * (i % 8) as f32, 45.6 + 14.0 * (i / 8) as f32]).collect()
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_by(f32::total_cmp);
    values[values.len() / 2]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn follows_known_warps(du in -18.0..18.0_f32, dv in -14.0..14.0_f32, turn in -0.03..0.03_f32, zoom in 0.98..1.02_f32) {
        let before = ImagePyramid::new(&image([0.0; 2], 0.0, 1.0, 1.0), 3);
        let after = ImagePyramid::new(&image([du, dv], turn, zoom, 1.0), 3);
        let found = OpticalFlow::new(&FlowConfig::default()).unwrap().track(&before, &after, &grid());
        let tracked: Vec<f32> = grid().iter().zip(&found).filter(|(_, f)| f.status == FlowStatus::Tracked).map(|(&p, f)| {
            let e = moved(p, [du, dv], turn, zoom);
            (f.point[0] - e[0]).hypot(f.point[1] - e[1])
        }).collect();
        prop_assert!(tracked.len() >= 36, "{} tracked", tracked.len());
        prop_assert!(median(tracked.clone()) < 0.12, "{}", median(tracked));
    }
}

#[test]
fn affine_light_is_followed_only_when_asked_for() {
    let before = ImagePyramid::new(&image([0.0; 2], 0.0, 1.0, 1.0), 3);
    let after = ImagePyramid::new(&image([4.3, -2.2], 0.0, 1.0, 0.6), 3);
    let error = |lighting: Lighting| {
        let mut config = FlowConfig::default();
        config.lighting = lighting;
        config.max_forward_backward = None;
        let found = OpticalFlow::new(&config).unwrap().track(&before, &after, &grid());
        median(
            grid()
                .iter()
                .zip(&found)
                .map(|(p, f)| (f.point[0] - p[0] - 4.3).hypot(f.point[1] - p[1] + 2.2))
                .collect(),
        )
    };
    let (constant, affine) = (error(Lighting::Constant), error(Lighting::Affine));
    assert!(affine < 0.02 && constant > 0.1, "{affine} {constant}");
}

#[test]
fn every_way_to_fail_has_its_name() {
    let textured = image([0.0; 2], 0.0, 1.0, 1.0);
    let before = ImagePyramid::new(&textured, 3);
    let flat = ImagePyramid::new(&GrayImage::new(WIDTH, HEIGHT, vec![0.5; WIDTH * HEIGHT]).unwrap(), 3);
    let mut flow = OpticalFlow::new(&FlowConfig::default()).unwrap();
    let status = |flow: &mut OpticalFlow, from: &ImagePyramid, to: &ImagePyramid, p: [f32; 2]| {
        flow.track(from, to, &[p])[0].status
    };
    assert_eq!(status(&mut flow, &before, &before, [100.0, 80.0]), FlowStatus::Tracked);
    for p in [[-1.0, 5.0], [f32::NAN, 5.0], [5.0, f32::INFINITY], [1e30, 1e30], [WIDTH as f32, 5.0]] {
        assert_eq!(status(&mut flow, &before, &before, p), FlowStatus::OutOfImage, "{p:?}");
    }
    assert_eq!(status(&mut flow, &flat, &before, [100.0, 80.0]), FlowStatus::NoTexture);
    assert_ne!(status(&mut flow, &before, &flat, [100.0, 80.0]), FlowStatus::Tracked);
    // The point leaves the image at the right border.
    let after = ImagePyramid::new(&image([12.0, 0.0], 0.0, 1.0, 1.0), 3);
    assert_ne!(status(&mut flow, &before, &after, [WIDTH as f32 - 4.0, 80.0]), FlowStatus::Tracked);
    // A patch is replaced: a window found there differs, or does not lead back.
    let mut data = textured.data().to_vec();
    for v in 60..100 {
        for u in 80..120 {
            data[v * WIDTH + u] = waves(u as f32 * 1.7 + 900.0, v as f32 * 1.4 + 40.0);
        }
    }
    let covered = ImagePyramid::new(&GrayImage::new(WIDTH, HEIGHT, data).unwrap(), 3);
    assert_ne!(status(&mut flow, &before, &covered, [100.0, 80.0]), FlowStatus::Tracked);
    assert_eq!(status(&mut flow, &before, &covered, [40.0, 120.0]), FlowStatus::Tracked);
}

#[test]
fn a_good_guess_bridges_what_the_pyramid_cannot() {
    let before = ImagePyramid::new(&image([0.0; 2], 0.0, 1.0, 1.0), 0);
    let after = ImagePyramid::new(&image([24.0, -9.0], 0.0, 1.0, 1.0), 0);
    let mut config = FlowConfig::default();
    config.halvings = 0;
    let mut flow = OpticalFlow::new(&config).unwrap();
    let point = [90.0, 80.0];
    let mut found = Vec::new();
    flow.track_into(&before, &after, &[point], &[[112.0, 72.0]], &mut found);
    assert_eq!(found[0].status, FlowStatus::Tracked);
    assert!((found[0].point[0] - 114.0).hypot(found[0].point[1] - 71.0) < 0.05, "{:?}", found[0].point);
    let lost = flow.track(&before, &after, &[point])[0];
    assert!(lost.status != FlowStatus::Tracked || (lost.point[0] - 114.0).abs() > 1.0);
}

fn whole() -> BoundingBox {
    BoundingBox::new(0.0, 0.0, WIDTH as f32, HEIGHT as f32).unwrap()
}

/// `cv2.goodFeaturesToTrack` of `OpenCV` 5.0 finds the same four corners.
#[test]
fn a_square_has_four_corners() {
    let value = |i: usize| {
        let (u, v) = (i % WIDTH, i / WIDTH);
        if (60..120).contains(&u) && (40..90).contains(&v) { 0.9 } else { 0.1 }
    };
    let image = GrayImage::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(value).collect()).unwrap();
    let mut corners = CornerDetector::new(&CornerConfig::default()).unwrap().detect(&image, whole(), None);
    assert_eq!(corners.len(), 4);
    corners.sort_by(|a, b| {
        (a.point[0] + 1000.0 * a.point[1].round()).total_cmp(&(b.point[0] + 1000.0 * b.point[1].round()))
    });
    for (corner, expected) in corners.iter().zip([[59.5, 39.5], [119.5, 39.5], [59.5, 89.5], [119.5, 89.5]]) {
        assert!(
            (corner.point[0] - expected[0]).abs() < 1.5 && (corner.point[1] - expected[1]).abs() < 1.5,
            "{corner:?}"
        );
    }
}

#[test]
fn corners_of_an_image_before_are_not_found_again() {
    let mut detector = CornerDetector::new(&CornerConfig::default()).unwrap();
    assert!(!detector.detect(&image([0.0; 2], 0.0, 1.0, 1.0), whole(), None).is_empty());
    // Of another width, so that its border is elsewhere in the detector's buffers.
    let flat = GrayImage::new(WIDTH, HEIGHT, vec![0.5; WIDTH * HEIGHT]).unwrap();
    let narrow = BoundingBox::new(0.0, 0.0, 60.0, HEIGHT as f32).unwrap();
    assert_eq!(detector.detect(&flat, narrow, None), []);
}

#[test]
fn corners_keep_to_region_mask_and_distance() {
    let image = image([0.0; 2], 0.0, 1.0, 1.0);
    let mut config = CornerConfig::default();
    config.min_distance = 9.0;
    let mut detector = CornerDetector::new(&config).unwrap();
    let region = BoundingBox::new(30.0, 20.0, 150.0, 120.0).unwrap();
    let mask = Mask::new(WIDTH, HEIGHT, (0..WIDTH * HEIGHT).map(|i| i % WIDTH > 70).collect()).unwrap();
    let corners = detector.detect(&image, region, Some(&mask));
    assert!(corners.len() > 10);
    for (i, a) in corners.iter().enumerate() {
        assert!(a.point[0] > 70.0 && a.point[0] < 150.0 && a.point[1] > 20.0 && a.point[1] < 120.0);
        for b in &corners[..i] {
            assert!(
                (a.point[0] - b.point[0]).hypot(a.point[1] - b.point[1]) >= 9.0 && b.strength >= a.strength
            );
        }
    }
}

#[test]
fn empty_regions_and_tiny_images_have_no_corners() {
    let mut detector = CornerDetector::new(&CornerConfig::default()).unwrap();
    let outside = BoundingBox::new(-500.0, -500.0, -100.0, -100.0).unwrap();
    assert!(detector.detect(&image([0.0; 2], 0.0, 1.0, 1.0), outside, None).is_empty());
    for (width, height) in [(1, 1), (2, 9), (3, 3), (4, 4)] {
        let tiny =
            GrayImage::new(width, height, (0..width * height).map(|i| (i % 2) as f32).collect()).unwrap();
        assert!(detector.detect(&tiny, whole(), None).is_empty());
    }
    let flat = GrayImage::new(WIDTH, HEIGHT, vec![0.4; WIDTH * HEIGHT]).unwrap();
    assert!(detector.detect(&flat, whole(), None).is_empty());
}

//! The window tracker on rendered targets with known places.

use dymlm_core::BoundingBox;
use dymlm_tracking::{Error, GrayImage, KcfConfig, KcfTracker};
use proptest::prelude::*;

/// Smooth noise with features about `scale` pixels wide.
fn texture(u: f32, v: f32, scale: f32, seed: u32) -> f32 {
    let hash = |i: i32, j: i32| {
        let mut h = (i as u32).wrapping_mul(0x9e37_79b1)
            ^ (j as u32).wrapping_mul(0x85eb_ca77)
            ^ seed.wrapping_mul(0xc2b2_ae3d);
        h ^= h >> 15;
        h = h.wrapping_mul(0x2c1b_3c6d);
        h ^= h >> 13;
        (h >> 8) as f32 / (1 << 24) as f32
    };
    let (x, y) = (u / scale, v / scale);
    let (i, j) = (x.floor(), y.floor());
    let (fx, fy) = (x - i, y - j);
    let (wx, wy) = (fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy));
    let (i, j) = (i as i32, j as i32);
    let row = |j: i32| hash(i, j) * (1.0 - wx) + hash(i + 1, j) * wx;
    row(j) * (1.0 - wy) + row(j + 1) * wy
}

/// A textured target of `size` pixels around `center` on another texture, 200x160 pixels, with a contrast.
fn scene(center: [f32; 2], size: [f32; 2], zoom: f32, contrast: f32) -> GrayImage {
    let value = |i: usize| {
        let (u, v) = ((i % 200) as f32, (i / 200) as f32);
        let (x, y) = ((u - center[0]) / zoom, (v - center[1]) / zoom);
        let inside = x.abs() <= 0.5 * size[0] && y.abs() <= 0.5 * size[1];
        let value =
            if inside { texture(x + 300.0, y + 300.0, 7.0, 1) } else { 0.3 + 0.25 * texture(u, v, 11.0, 2) };
        0.5 + contrast * (value - 0.5)
    };
    GrayImage::new(200, 160, (0..200 * 160).map(value).collect()).unwrap()
}

fn region(center: [f32; 2], size: [f32; 2]) -> BoundingBox {
    let [w, h] = size.map(|side| 0.5 * side);
    // From pixel coordinates to box coordinates.
    let [u, v] = center.map(|c| c + 0.5);
    BoundingBox::new(u - w, v - h, u + w, v + h).unwrap()
}

const SIZE: [f32; 2] = [44.0, 36.0];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn finds_a_shift_to_a_pixel(du in -14.0..14.0_f32, dv in -12.0..12.0_f32) {
        let config = KcfConfig::default();
        let mut tracker = KcfTracker::new(&scene([100.0, 80.0], SIZE, 1.0, 0.8), region([100.0, 80.0], SIZE), &config).unwrap();
        let found = tracker.update(&scene([100.0 + du, 80.0 + dv], SIZE, 1.0, 0.8));
        let expected = region([100.0 + du, 80.0 + dv], SIZE).center();
        let [u, v] = found.bounding_box.center();
        prop_assert!((u - expected[0]).hypot(v - expected[1]) < 1.5, "{u} {v} for {expected:?}");
        prop_assert!(found.peak_to_sidelobe > 6.0, "{}", found.peak_to_sidelobe);
    }
}

/// The filter alone is off by 0.15 pixels here, whether the target moves by whole pixels or by fractions.
#[test]
fn follows_a_target_to_a_twentieth_of_a_pixel() {
    for whole in [false, true] {
        let place = |i: usize| {
            let t = i as f32;
            let center = [60.0 + 2.1 * t + 5.0 * (0.3 * t).sin(), 80.0 + 20.0 * (0.2 * t).sin()];
            if whole { center.map(f32::round) } else { center }
        };
        let mut tracker =
            KcfTracker::new(&scene(place(0), SIZE, 1.0, 0.8), region(place(0), SIZE), &KcfConfig::default())
                .unwrap();
        let mut sum = 0.0;
        for i in 1..36 {
            let found = tracker.update(&scene(place(i), SIZE, 1.0, 0.8));
            let [u, v] = found.bounding_box.center();
            let expected = region(place(i), SIZE).center();
            sum += (u - expected[0]).hypot(v - expected[1]);
            assert_eq!(found.scale, 1.0);
        }
        assert!(sum / 35.0 < 0.05, "{}", sum / 35.0);
    }
}

#[test]
fn follows_a_target_that_comes_nearer() {
    let mut tracker = KcfTracker::new(
        &scene([90.0, 80.0], SIZE, 1.0, 0.8),
        region([90.0, 80.0], SIZE),
        &KcfConfig::default(),
    )
    .unwrap();
    let mut overlap = 1.0_f64;
    for i in 1..=40 {
        let zoom: f32 = 1.0 + 0.015 * i as f32;
        let center = [90.0 + 0.6 * i as f32, 80.0 - 0.3 * i as f32];
        let found = tracker.update(&scene(center, SIZE, zoom, 0.8));
        overlap = overlap.min(found.bounding_box.iou(&region(center, SIZE.map(|side| side * zoom))));
    }
    // The size lags by one or two scale steps.
    assert!(overlap > 0.6, "{overlap}");
}

#[test]
fn a_dimmed_light_changes_little() {
    let mut tracker = KcfTracker::new(
        &scene([100.0, 80.0], SIZE, 1.0, 0.9),
        region([100.0, 80.0], SIZE),
        &KcfConfig::default(),
    )
    .unwrap();
    let [u, v] = tracker.update(&scene([107.0, 75.0], SIZE, 1.0, 0.35)).bounding_box.center();
    assert!((u - 107.5).hypot(v - 75.5) < 1.5, "{u} {v}");
}

#[test]
fn what_hides_the_target_is_not_learned() {
    let mut tracker = KcfTracker::new(
        &scene([100.0, 80.0], SIZE, 1.0, 0.8),
        region([100.0, 80.0], SIZE),
        &KcfConfig::default(),
    )
    .unwrap();
    let seen = tracker.update(&scene([101.0, 80.0], SIZE, 1.0, 0.8));
    assert!(seen.is_learned);
    let blank = GrayImage::new(
        200,
        160,
        (0..200 * 160).map(|i| texture((i % 200) as f32, (i / 200) as f32, 9.0, 77)).collect(),
    )
    .unwrap();
    let hidden = tracker.locate(&blank);
    assert!(!hidden.is_learned);
    assert!(
        hidden.peak_to_sidelobe < 0.6 * seen.peak_to_sidelobe,
        "{} {}",
        hidden.peak_to_sidelobe,
        seen.peak_to_sidelobe
    );
    for _ in 0..20 {
        let mut config = tracker.clone();
        config.locate(&blank);
    }
    tracker.move_to(&blank, region([101.0, 80.0], SIZE)).unwrap();
    let again = tracker.update(&scene([104.0, 83.0], SIZE, 1.0, 0.8));
    assert!(again.bounding_box.iou(&region([104.0, 83.0], SIZE)) > 0.9);
}

#[test]
fn the_same_images_give_the_same_bits() {
    let run = || {
        let mut tracker = KcfTracker::new(
            &scene([90.0, 80.0], SIZE, 1.0, 0.8),
            region([90.0, 80.0], SIZE),
            &KcfConfig::default(),
        )
        .unwrap();
        (1..8).map(|i| tracker.update(&scene([90.0 + i as f32, 80.0], SIZE, 1.0, 0.8))).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn targets_at_the_border_and_odd_images_do_no_harm() {
    let image = scene([10.0, 10.0], SIZE, 1.0, 0.8);
    let mut tracker = KcfTracker::new(&image, region([8.0, 6.0], SIZE), &KcfConfig::default()).unwrap();
    for other in [
        scene([2.0, 2.0], SIZE, 1.0, 0.8),
        GrayImage::new(30, 20, vec![0.5; 600]).unwrap(),
        GrayImage::new(1, 1, vec![0.5]).unwrap(),
        GrayImage::new(50, 40, vec![f32::MAX; 2000]).unwrap(),
        scene([2.0, 2.0], SIZE, 1.0, 0.8),
    ] {
        let found = tracker.update(&other);
        let [u, v] = found.bounding_box.center();
        assert!(u.is_finite() && v.is_finite() && found.scale > 0.0, "{found:?}");
    }
    // Long, thin targets.
    for size in [[180.0, 8.0], [8.0, 150.0]] {
        KcfTracker::new(&image, region([100.0, 80.0], size), &KcfConfig::default()).unwrap().update(&image);
    }
}

#[test]
fn a_target_whose_middle_is_outside_the_image_stays_where_it_is() {
    for center in [[-25.0, 80.0], [224.0, 80.0], [100.0, 172.0]] {
        let image = scene(center, [80.0, 60.0], 1.0, 0.8);
        let target = region(center, [80.0, 60.0]);
        let mut tracker = KcfTracker::new(&image, target, &KcfConfig::default()).unwrap();
        let [u, v] = tracker.update(&image).bounding_box.center();
        let [expected_u, expected_v] = target.center();
        assert!((u - expected_u).hypot(v - expected_v) < 1.0, "{u} {v} for {center:?}");
    }
}

#[test]
fn refused_targets_and_configs_are_named_and_change_nothing() {
    let image = scene([100.0, 80.0], SIZE, 1.0, 0.8);
    let outside = BoundingBox::new(500.0, 10.0, 560.0, 60.0).unwrap();
    let tiny = BoundingBox::new(50.0, 50.0, 53.0, 90.0).unwrap();
    let absurd = BoundingBox::new(-1e30, -1e30, 1e30, 1e30).unwrap();
    for target in [outside, tiny, absurd] {
        assert!(matches!(
            KcfTracker::new(&image, target, &KcfConfig::default()),
            Err(Error::TargetSize { .. })
        ));
    }
    let mut tracker = KcfTracker::new(&image, region([100.0, 80.0], SIZE), &KcfConfig::default()).unwrap();
    let before = tracker.bounding_box();
    assert!(tracker.move_to(&image, tiny).is_err());
    assert_eq!(tracker.bounding_box(), before);
    let mut config = KcfConfig::default();
    config.padding = 0.5;
    let error = KcfTracker::new(&image, region([100.0, 80.0], SIZE), &config).unwrap_err();
    assert_eq!(error.to_string(), "kcf.padding = 0.5 is outside its range 1.2..=8");
}

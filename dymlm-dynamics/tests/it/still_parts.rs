//! Somebody sits on a seat: a bulging body before a wall, below it a box whose top the body meets in a
//! crease.
use dymlm_core::{
    BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Pose, SensorModel, SplitMix64,
};
use dymlm_dynamics::{DynamicsConfig, MaskMode, Preprocessor};
use dymlm_test_support::normal;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
const FRAME_RATE: f64 = 10.0;

/// The body's columns and rows, and the seat's: its top recedes over the first rows.
const BODY: [[usize; 2]; 2] = [[260, 380], [100, 300]];
const SEAT: [[usize; 2]; 2] = [[250, 390], [300, 370]];
const SEAT_TOP: usize = 20;

fn is_in([columns, rows]: [[usize; 2]; 2], u: usize, v: usize) -> bool {
    (columns[0]..columns[1]).contains(&u) && (rows[0]..rows[1]).contains(&v)
}

/// What the camera reads while the body leans towards it by `lean` metres.
fn frame(timestamp: f64, lean: f64) -> Frame {
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 319.5, 239.5).unwrap();
    let depth = (0..WIDTH * HEIGHT).map(|i| {
        let (u, v) = (i % WIDTH, i / WIDTH);
        let across = (u as f64 - 319.5) / 60.0;
        if is_in(BODY, u, v) {
            // Rounded towards the seat, too.
            let down = ((v as f64 - 200.0) / 100.0).max(0.0);
            (2.0 - lean - 0.12 * (1.0 - across * across).max(0.0).sqrt() + 0.1 * down.powi(4)) as f32
        } else if is_in(SEAT, u, v) {
            let top = (SEAT_TOP as f64 - (v - SEAT[1][0]) as f64).max(0.0) / SEAT_TOP as f64;
            (1.85 + 0.12 * top + 0.02 * across * across) as f32
        } else {
            3.0
        }
    });
    let depth = DepthImage::new(WIDTH, HEIGHT, depth.collect()).unwrap();
    Frame::new(timestamp, camera, depth, None).unwrap()
}

/// The frame as a Kinect of a quarter of the size reads it, with noise.
fn small_and_noisy(frame: &Frame) -> Frame {
    let (width, height) = (WIDTH / 4, HEIGHT / 4);
    let camera = PinholeCamera::new(width, height, 131.25, 131.25, 79.5, 59.5).unwrap();
    let sensor = SensorModel::kinect();
    let mut random = SplitMix64::new(frame.timestamp().to_bits());
    let depth = (0..width * height).map(|i| {
        let z = frame.depth().at(4 * (i % width) + 2, 4 * (i / width) + 2);
        z + sensor.sigma(z) * normal(&mut random) as f32
    });
    let depth = DepthImage::new(width, height, depth.collect()).unwrap();
    Frame::new(frame.timestamp(), camera, depth, None).unwrap()
}

/// The masks of static pixels and of movers after so many seconds of swaying to and fro by `sway` metres, in
/// a period of three seconds.
fn masks(mode: MaskMode, sway: f64, seconds: f64) -> (Mask, Mask) {
    let mut config = DynamicsConfig::default();
    config.mask.mode = mode;
    let mut preprocessor = Preprocessor::new(config, SensorModel::kinect()).unwrap();
    let sitter = BoundingBox::new(245.0, 95.0, 395.0, 375.0).unwrap();
    let found = [Detection::new("person", 0.9, sitter).unwrap()];
    for index in 0..=(seconds * FRAME_RATE) as u32 {
        let time = f64::from(index) / FRAME_RATE;
        let lean = sway * (std::f64::consts::TAU * time / 3.0).sin();
        preprocessor.process(&frame(time, lean), Some(&found), &Pose::identity()).unwrap();
    }
    (preprocessor.static_mask().clone(), preprocessor.mover_mask().clone())
}

/// The share of some pixels that a mask holds.
fn share(mask: &Mask, [columns, rows]: [[usize; 2]; 2]) -> f64 {
    let held = (rows[0]..rows[1]).map(|v| (columns[0]..columns[1]).filter(|&u| mask.at(u, v)).count());
    held.sum::<usize>() as f64 / ((columns[1] - columns[0]) * (rows[1] - rows[0])) as f64
}

/// The share of the seat's front, and of the body but for its lower end, that a mask holds.
fn shares(mask: &Mask) -> [f64; 2] {
    let front = [SEAT[0], [SEAT[1][0] + SEAT_TOP + 10, SEAT[1][1] - 4]];
    [front, [BODY[0], [100, 280]]].map(|part| share(mask, part))
}

#[test]
fn a_seat_is_static_while_who_sits_on_it_sways() {
    let (is_static, is_mover) = masks(MaskMode::Silhouette, 0.02, 6.0);
    let [seat, body] = shares(&is_static);
    assert!(seat > 0.95 && body < 0.01, "static: {seat} of the seat, {body} of the body");
    let [seat, body] = shares(&is_mover);
    assert!(seat < 0.01 && body > 0.9, "movers: {seat} of the seat, {body} of the body");
}

#[test]
fn as_long_as_nothing_has_moved_all_is_the_movers() {
    for (sway, seconds) in [(0.0, 6.0), (0.002, 6.0), (0.02, 2.0)] {
        let (is_static, is_mover) = masks(MaskMode::Silhouette, sway, seconds);
        assert_eq!(shares(&is_static), [0.0, 0.0], "{sway} m for {seconds} s");
        assert_eq!(shares(&is_mover), [1.0, 1.0], "{sway} m for {seconds} s");
    }
}

/// A part is judged by means of several readings there, too: single ones have too much noise.
#[test]
fn a_seat_is_static_in_a_small_noisy_image() {
    let sitter = BoundingBox::new(61.25, 23.75, 98.75, 93.75).unwrap();
    let found = [Detection::new("person", 0.9, sitter).unwrap()];
    for sway in [0.0, 0.02] {
        let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
        for index in 0..=90_u32 {
            let time = f64::from(index) / FRAME_RATE;
            let lean = sway * (std::f64::consts::TAU * time / 3.0).sin();
            let frame = small_and_noisy(&frame(time, lean));
            preprocessor.process(&frame, Some(&found), &Pose::identity()).unwrap();
            if time >= 6.0 {
                let is_static = preprocessor.static_mask();
                let of_full_size = Mask::from_fn(WIDTH, HEIGHT, |u, v| is_static.at(u / 4, v / 4)).unwrap();
                let [seat, body] = shares(&of_full_size);
                let is_right = if sway > 0.0 { seat > 0.9 } else { seat == 0.0 };
                assert!(
                    is_right && body < 0.01,
                    "{sway} m, {time} s: {seat} of the seat, {body} of the body"
                );
            }
        }
    }
}

/// Below the body, and as far away: the side of a chair, as high as a correction reaches.
const CHAIR: [[usize; 2]; 2] = [[260, 380], [300, 345]];

/// The shares of the chair and of the body that are static after so many seconds. The sitter's detected box
/// ends where the chair begins, so that only a correction takes it; `is_detected` says whether the chair has
/// a detection of its own, and `stands` whether it is there at a time.
fn static_beside_chair(is_detected: bool, seconds: f64, stands: impl Fn(f64) -> bool) -> [f64; 2] {
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, 319.5, 239.5).unwrap();
    let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
    let mut found =
        vec![Detection::new("person", 0.9, BoundingBox::new(255.0, 95.0, 385.0, 300.0).unwrap()).unwrap()];
    if is_detected {
        let chair = BoundingBox::new(255.0, 300.0, 385.0, 350.0).unwrap();
        found.push(Detection::new("chair", 0.6, chair).unwrap());
    }
    for index in 0..=(seconds * FRAME_RATE) as u32 {
        let time = f64::from(index) / FRAME_RATE;
        let is_near = |u, v| is_in(BODY, u, v) || stands(time) && is_in(CHAIR, u, v);
        let depth = (0..WIDTH * HEIGHT).map(|i| if is_near(i % WIDTH, i / WIDTH) { 2.0 } else { 3.0 });
        let depth = DepthImage::new(WIDTH, HEIGHT, depth.collect()).unwrap();
        let frame = Frame::new(time, camera, depth, None).unwrap();
        preprocessor.process(&frame, Some(&found), &Pose::identity()).unwrap();
    }
    // But for the rim of the body.
    let [columns, rows] = CHAIR;
    [[columns, [rows[0] + 16, rows[1]]], BODY].map(|part| share(preprocessor.static_mask(), part))
}

#[test]
fn a_detected_chair_beyond_the_sitters_box_is_static_though_nobody_moves() {
    assert_eq!(static_beside_chair(false, 1.0, |_| true), [0.0, 0.0], "no detection tells the chair apart");
    for seconds in [0.0, 1.0, 6.0] {
        assert_eq!(static_beside_chair(true, seconds, |_| true), [1.0, 0.0], "after {seconds} s");
    }
}

#[test]
fn what_appears_there_is_the_movers_though_a_thing_is_detected() {
    assert_eq!(static_beside_chair(true, 3.0, |time| time > 2.5), [0.0, 0.0]);
}

#[test]
fn a_box_is_masked_whole() {
    let (is_static, _) = masks(MaskMode::Box, 0.02, 6.0);
    assert_eq!(shares(&is_static), [0.0, 0.0]);
}

//! Frames between two looks of the detector, from a camera that turns: who was found stays masked where they
//! are seen now, and nobody is where they were in the image.

use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_dynamics::{BoxTracker, DynamicsConfig, Preprocessor, TrackerConfig, View};

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
const CENTER: [f64; 2] = [319.5, 239.5];

fn frame(timestamp: f64, depth: impl Fn(usize, usize) -> f32) -> Frame {
    let camera = PinholeCamera::new(WIDTH, HEIGHT, 525.0, 525.0, CENTER[0], CENTER[1]).unwrap();
    let depths = pixels().map(|(u, v)| depth(u, v)).collect();
    Frame::new(timestamp, camera, DepthImage::new(WIDTH, HEIGHT, depths).unwrap(), None).unwrap()
}

fn pixels() -> impl Iterator<Item = (usize, usize)> {
    (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (u, v)))
}

fn person(left: f32, top: f32, right: f32, bottom: f32) -> [Detection; 1] {
    [Detection::new("person", 0.9, BoundingBox::new(left, top, right, bottom).unwrap()).unwrap()]
}

fn preprocessor() -> Preprocessor {
    Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap()
}

/// A camera that has turned about one of its axes.
fn turned(degrees: f64, axis: usize) -> Pose {
    let (sin, cos) = (0.5 * degrees.to_radians()).sin_cos();
    let mut quaternion = [0.0, 0.0, 0.0, cos];
    quaternion[axis] = sin;
    Pose::new([0.0; 3], quaternion).unwrap()
}

/// Regression: the predicted box stayed upright, and of somebody who stands no more than a tenth was masked.
#[test]
fn who_stands_is_masked_while_the_camera_rolls() {
    for degrees in [20.0, 45.0, 60.0, 90.0, -70.0_f64] {
        // Across and along the body, in halves of its sides.
        let across_and_along = |roll: f64, u: usize, v: usize| {
            let (sin, cos) = roll.to_radians().sin_cos();
            let [x, y] = [u as f64 - CENTER[0], v as f64 - CENTER[1]];
            [(cos * x - sin * y) / 40.0, (sin * x + cos * y) / 170.0]
        };
        let is_person = |roll: f64, u, v| across_and_along(roll, u, v).iter().all(|c| c.abs() <= 1.0);
        let seen = |time: f64, roll: f64| {
            frame(time, |u, v| {
                let [across, _] = across_and_along(roll, u, v);
                if is_person(roll, u, v) { (2.0 - 0.15 * (1.0 - across * across).sqrt()) as f32 } else { 3.0 }
            })
        };
        let mut preprocessor = preprocessor();
        let found = person(280.0, 70.0, 360.0, 410.0);
        for time in [0.0, 1.0, 2.0] {
            preprocessor.process(&seen(time, 0.0), Some(&found), &Pose::identity()).unwrap();
        }
        let result = preprocessor.process(&seen(2.5, degrees), None, &turned(degrees, 2)).unwrap();
        let body: Vec<_> = pixels().filter(|&(u, v)| is_person(degrees, u, v)).collect();
        let masked = body.iter().filter(|&&(u, v)| !result.static_mask.at(u, v)).count();
        let share = masked as f64 / body.len() as f64;
        assert!(share > 0.9, "{degrees} degrees: {share:.2} of the person masked");
    }
}

/// Somebody 2 m before the camera, 1.7 m tall and half a metre wide, who walks along their own right at half
/// a metre a second; the box around the ellipse in them, seen by a camera that has rolled.
fn walker(camera: &PinholeCamera, time: f64, pose: &Pose) -> Detection {
    let outline = (0..64).map(|i| f64::from(i) * std::f64::consts::TAU / 64.0);
    let seen = outline.map(|angle| {
        let (sin, cos) = angle.sin_cos();
        let place = [0.5 * time - 0.4 + 0.25 * cos, 0.85 * sin, 2.0];
        camera.project(pose.inverse().transform_point(place)).unwrap()
    });
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for pixel in seen {
        low = [0, 1].map(|axis| low[axis].min(pixel[axis]));
        high = [0, 1].map(|axis| high[axis].max(pixel[axis]));
    }
    let [[left, top], [right, bottom]] = [low, high].map(|corner| corner.map(|c| c as f32));
    Detection::new("person", 0.9, BoundingBox::new(left, top, right, bottom).unwrap()).unwrap()
}

/// The detector runs twice a second; the camera rolls between two of its looks, and its axes may be flipped.
#[test]
fn a_walker_s_box_turns_with_the_image() {
    for (fx, fy) in [(525.0, 525.0), (-525.0, 525.0), (525.0, -525.0)] {
        let camera = PinholeCamera::new(WIDTH, HEIGHT, fx, fy, CENTER[0], CENTER[1]).unwrap();
        for degrees in [45.0, -90.0] {
            let mut tracker = BoxTracker::new(TrackerConfig::default()).unwrap();
            for tenth in 0_u8..20 {
                let time = f64::from(tenth) / 10.0;
                let roll = degrees * ((f64::from(tenth) - 10.0) / 4.0).clamp(0.0, 1.0);
                let world_from_camera = turned(roll, 2);
                let view = View { camera, world_from_camera };
                let truth = walker(&camera, time, &world_from_camera);
                let boxes = if tenth % 5 == 0 {
                    tracker.update(time, std::slice::from_ref(&truth), Some(&view)).unwrap()
                } else {
                    tracker.predict(time, Some(&view)).unwrap()
                };
                assert_eq!((boxes.len(), boxes[0].track_id.get()), (1, 0), "{degrees} degrees, {time} s");
                let iou = boxes[0].bounding_box.iou(&truth.bounding_box());
                // The second look shows how fast they walk.
                assert!(tenth < 5 || iou > 0.85, "[{fx}, {fy}], {degrees} degrees, {time} s: {iou}");
            }
        }
    }
}

/// Regression: what stood at the old pixels, about as far away, was taken for them.
#[test]
fn who_is_beside_or_behind_the_camera_is_not_in_the_image() {
    for (left, degrees) in [(280, 180.0), (280, 80.0), (540, -55.0)] {
        let is_thing = |u, v| (left..left + 80).contains(&u) && (60..420).contains(&v);
        let seen = |time: f64| frame(time, |u, v| if is_thing(u, v) { 2.0 } else { 3.0 });
        let mut preprocessor = preprocessor();
        let found = person(left as f32, 60.0, left as f32 + 80.0, 420.0);
        for time in [0.0, 1.0] {
            preprocessor.process(&seen(time), Some(&found), &Pose::identity()).unwrap();
        }
        let result = preprocessor.process(&seen(2.0), Some(&[]), &turned(degrees, 1)).unwrap();
        assert!(result.movers.is_empty(), "turned by {degrees} degrees: {:?}", result.movers);
    }
}

//! Preprocessing of a 640x480 frame with two people in it, and tracking of a crowd alone.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dymlm_benches::{kinect, room_depth};
use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Pose, SensorModel};
use dymlm_dynamics::{BoxTracker, DynamicsConfig, Preprocessor, TrackerConfig};

/// Left columns of the two people, and their distances in metres.
const PEOPLE: [(usize, f32); 2] = [(120, 1.5), (380, 2.2)];
const PERSON_WIDTH: usize = 140;

/// The room with two people: elliptic cylinders from near the upper border of the image to the lower one.
#[allow(clippy::unwrap_used, reason = "the buffer has the camera's size")]
fn people_in_a_room() -> DepthImage {
    let room = room_depth();
    let (width, height) = (room.width(), room.height());
    let mut data = room.into_data();
    for (left, distance) in PEOPLE {
        for v in 40..height {
            for column in 0..PERSON_WIDTH {
                let across = 2.0 * column as f32 / PERSON_WIDTH as f32 - 1.0;
                let depth = &mut data[v * width + left + column];
                *depth = depth.min(distance - 0.2 * (1.0 - across * across).sqrt());
            }
        }
    }
    DepthImage::new(width, height, data).unwrap()
}

#[allow(clippy::unwrap_used, reason = "constants")]
fn frame(timestamp: f64) -> Frame {
    Frame::new(timestamp, kinect(), people_in_a_room(), None).unwrap()
}

/// Boxes that cut off ten pixels of a person at the sides and at the top.
#[allow(clippy::unwrap_used, reason = "constants")]
fn boxes() -> [BoundingBox; 2] {
    PEOPLE.map(|(left, _)| {
        BoundingBox::new(left as f32 + 10.0, 50.0, (left + PERSON_WIDTH) as f32 - 10.0, 480.0).unwrap()
    })
}

#[allow(clippy::unwrap_used, reason = "constants")]
fn detections() -> [Detection; 2] {
    boxes().map(|bounding_box| Detection::new("person", 0.9, bounding_box).unwrap())
}

#[allow(clippy::unwrap_used, reason = "constants")]
fn preprocess(criterion: &mut Criterion) {
    let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
    let (frame, detections) = (frame(0.0), detections());
    criterion.bench_function("dymlm-dynamics/preprocess/two_people", |bencher| {
        bencher.iter(|| {
            let result = preprocessor.process(black_box(&frame), Some(&detections), &Pose::identity());
            result.map(|result| result.movers.len())
        });
    });
}

#[allow(clippy::unwrap_used, reason = "constants")]
fn track(criterion: &mut Criterion) {
    let mut tracker = BoxTracker::new(TrackerConfig::default()).unwrap();
    let crowd: Vec<Detection> = (0_u8..50)
        .map(|i| {
            let (x, y) = (f32::from(i % 10) * 60.0, f32::from(i / 10) * 90.0);
            Detection::new("person", 0.9, BoundingBox::new(x, y, x + 80.0, y + 120.0).unwrap()).unwrap()
        })
        .collect();
    criterion.bench_function("dymlm-dynamics/track/50_people", |bencher| {
        bencher.iter(|| tracker.update(0.0, black_box(&crowd), None).map(<[_]>::len));
    });
}

criterion_group!(benches, preprocess, track);
criterion_main!(benches);

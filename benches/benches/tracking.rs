//! Object tracking: optical flow, the correlation filter, and a whole step of the object tracker, at 640x480.

#![allow(clippy::expect_used, reason = "constants")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm_core::{BoundingBox, SensorModel};
use dymlm_sim::{
    CameraPath, CarriedKind, CarriedMotion, CarriedObject, Sequence, SequenceConfig, SimulatedFrame,
};
use dymlm_tracking::{
    FlowConfig, GrayImage, ImagePyramid, KcfConfig, KcfTracker, ObjectModel, ObjectTracker,
    ObjectTrackerConfig, OpticalFlow,
};

/// Frames in which a hand carries a box; it leaves its place after one second.
const FIRST: usize = 45;
const FRAMES: usize = 12;
const POINTS: usize = 200;

fn sequence() -> Sequence {
    let mut config = SequenceConfig::default();
    config.people = 0;
    config.frame_rate = 30.0;
    config.frames = FIRST + FRAMES;
    config.path = CameraPath::Xyz;
    config.carried = Some(CarriedObject::new(CarriedKind::Box, CarriedMotion::RotationZ));
    Sequence::new(&config).expect("the config is in range")
}

fn frames() -> Vec<SimulatedFrame> {
    let sequence = sequence();
    (FIRST..FIRST + FRAMES).filter_map(|index| sequence.frame(index)).collect()
}

fn gray(frame: &SimulatedFrame) -> GrayImage {
    GrayImage::from_color(frame.frame.color().expect("rendered in colour"))
}

fn flow(criterion: &mut Criterion) {
    let frames = frames();
    let [before, after] = [&frames[0], &frames[1]].map(gray);
    let points: Vec<[f32; 2]> =
        (0..POINTS).map(|i| [60.0 + 26.0 * (i % 20) as f32, 60.0 + 36.0 * (i / 20) as f32]).collect();
    let mut group = criterion.benchmark_group("tracking/flow");
    group.throughput(Throughput::Elements(POINTS as u64));
    for (name, back) in [("200_points", None), ("200_points_forth_and_back", Some(0.7))] {
        let mut config = FlowConfig::default();
        config.max_forward_backward = back;
        let mut flow = OpticalFlow::new(&config).expect("the config is in range");
        let [mut from, mut to] = [ImagePyramid::empty(config.halvings), ImagePyramid::empty(config.halvings)];
        let mut found = Vec::new();
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                from.build(&before);
                to.build(&after);
                flow.track_into(&from, &to, &points, &points, &mut found);
            });
        });
    }
    group.finish();
}

fn kcf(criterion: &mut Criterion) {
    let images: Vec<GrayImage> = frames().iter().map(gray).collect();
    let target = BoundingBox::new(290.0, 200.0, 354.0, 264.0).expect("a box");
    let mut group = criterion.benchmark_group("tracking/kcf");
    group.throughput(Throughput::Elements(1));
    group.bench_function("update_64px", |bencher| {
        let mut tracker =
            KcfTracker::new(&images[0], target, &KcfConfig::default()).expect("the target is in the image");
        let mut next = images.iter().cycle();
        bencher.iter(|| next.next().map(|image| tracker.update(image)));
    });
    group.finish();
}

/// Eleven steps, each time from the same start, so that the motion never jumps.
fn object(criterion: &mut Criterion) {
    let frames = frames();
    let thing = frames[0].carried.expect("a box is carried");
    let model = ObjectModel::cuboid(thing.lengths).expect("a box has sides");
    let start = ObjectTracker::new(
        &frames[0].frame,
        &frames[0].world_from_camera,
        model,
        Some(thing.label),
        &thing.world_from_object,
        SensorModel::kinect(),
        &ObjectTrackerConfig::default(),
    )
    .expect("the box is in view");
    let mut group = criterion.benchmark_group("tracking/object");
    group.throughput(Throughput::Elements(FRAMES as u64 - 1));
    group.bench_function("11_steps", |bencher| {
        bencher.iter_batched(
            || start.clone(),
            |mut tracker| {
                for frame in &frames[1..] {
                    tracker.track(&frame.frame, &frame.detections, &frame.world_from_camera).ok();
                }
                tracker
            },
            criterion::BatchSize::LargeInput,
        );
    });
    group.finish();
}

criterion_group!(benches, flow, kcf, object);
criterion_main!(benches);

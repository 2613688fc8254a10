//! The plane step of a 640x480 frame: detection, the map, and both together, on a synthetic room, on a
//! rendered office, and on the kitchen recording if it is there (`DYMLM_DATA` or `../shared/data`).

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{kinect, room_depth};
use dymlm_core::{Frame, Pose, SensorModel};
use dymlm_io::{TumDataset, TumOptions};
use dymlm_planes::{PlaneConfig, PlaneDetector, PlaneDetectorConfig, PlaneMap, PlaneMapper};
use dymlm_sim::{Sequence, SequenceConfig};
use dymlm_test_support::{Rectangle, World, look_at, recording};

/// Frames of one place, with their poses.
struct Input {
    name: &'static str,
    frames: Vec<(Frame, Pose)>,
}

fn inputs() -> Vec<Input> {
    let room = Frame::new(0.0, kinect(), room_depth(), None).unwrap();
    let office = Sequence::new(&SequenceConfig::default()).unwrap();
    let office = [10, 40, 70, 100].map(|k| office.frame(k).unwrap());
    let mut inputs = vec![
        Input { name: "room", frames: vec![(room, Pose::identity())] },
        Input {
            name: "office",
            frames: office.into_iter().map(|f| (f.frame, f.world_from_camera)).collect(),
        },
    ];
    inputs.extend(kitchen());
    inputs
}

/// Every twentieth frame of the recording, if it is there.
fn kitchen() -> Option<Input> {
    let dataset = TumDataset::open(recording("kitchen")?, &TumOptions::default()).ok()?;
    let indices = (0..dataset.frames().len()).step_by(20);
    let frames = indices.filter_map(|index| dataset.load(index).ok());
    Some(Input { name: "kitchen", frames: frames.map(|f| (f.frame, f.world_from_camera)).collect() })
}

fn detect(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-planes/detect");
    for input in &inputs() {
        let mut detector =
            PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect()).unwrap();
        group.throughput(Throughput::Elements(input.frames.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(input.name), |bencher| {
            bencher.iter(|| {
                for (frame, _) in &input.frames {
                    black_box(detector.detect(frame, None, &[]).unwrap());
                }
            });
        });
    }
    group.finish();
}

fn map(criterion: &mut Criterion) {
    let (config, sensor) = (PlaneConfig::default(), SensorModel::kinect());
    let mut group = criterion.benchmark_group("dymlm-planes/map_insert");
    for input in &inputs() {
        let mut detector = PlaneDetector::new(&config.detector, &sensor).unwrap();
        let mut detect = |frame: &Frame| detector.detect(frame, None, &[]).unwrap().to_vec();
        let detected: Vec<_> =
            input.frames.iter().map(|(frame, pose)| (detect(frame), frame, pose)).collect();
        group.throughput(Throughput::Elements(detected.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(input.name), |bencher| {
            bencher.iter(|| {
                let mut map = PlaneMap::new(config.map.clone(), sensor).unwrap();
                for (planes, frame, pose) in &detected {
                    map.insert(black_box(planes), frame, pose).unwrap();
                }
                map
            });
        });
    }
    group.finish();
}

fn whole_step(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-planes/whole_step");
    for input in &inputs() {
        group.throughput(Throughput::Elements(input.frames.len() as u64));
        let mut mapper = PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect()).unwrap();
        group.bench_function(BenchmarkId::from_parameter(input.name), |bencher| {
            // As in a session: the map knows the place, the buffers have their size, and every frame is a new
            // key frame.
            bencher.iter(|| {
                for (frame, pose) in &input.frames {
                    mapper.insert(black_box(frame), None, &[], pose).unwrap();
                }
            });
        });
    }
    group.finish();
}

/// A camera has moved over a floor by `length` metres along x, with a key frame about every metre of its
/// path; the next key frame is measured. Its cost should only depend on what the frame sees.
fn walked_floor(criterion: &mut Criterion) {
    let floor = World::of(&[Rectangle::level([0.0; 3], 50.0, 50.0)]);
    let over = |x: f64| look_at([x, 0.8 * x - 1.0, 1.4], [x, 0.8 * x + 0.5, 0.0]);
    let frame = floor.frame(kinect(), &over(0.0), 1);
    let (config, sensor) = (PlaneConfig::default(), SensorModel::kinect());
    let planes =
        PlaneDetector::new(&config.detector, &sensor).unwrap().detect(&frame, None, &[]).unwrap().to_vec();
    let mut group = criterion.benchmark_group("dymlm-planes/walked_floor");
    for length in [80, 320, 1200] {
        let mut map = PlaneMap::new(config.map.clone(), sensor).unwrap();
        let mut walk = |x: f64| map.insert(black_box(&planes), &frame, &over(x)).unwrap();
        let mut at = 0.0;
        while at < f64::from(length) {
            walk(at);
            at += 0.8;
        }
        group.bench_function(BenchmarkId::from_parameter(format!("{length} m")), |bencher| {
            bencher.iter(|| {
                at += 0.8;
                walk(at)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, detect, map, whole_step, walked_floor);
criterion_main!(benches);

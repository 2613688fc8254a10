//! Rendering a frame of a sequence, and scoring maps against truth and reference.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SIZES, kinect, room_depth};
use dymlm_core::{Frame, PointCloud, Pose};
use dymlm_metrics::{ReferenceCloud, SpaceTruth, score_cloud};
use dymlm_sim::{DetectorConfig, FrameScratch, SensorConfig, Sequence, SequenceConfig, Truth, TruthConfig};

/// Frames of 640x480: with the default config, without sensor noise and detector failures, and with the
/// default config into reused buffers.
fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dymlm-sim/frame");
    group.throughput(Throughput::Elements(640 * 480)).sample_size(20);
    let mut ideal = SequenceConfig::default();
    ideal.sensor = SensorConfig::ideal();
    ideal.detector = DetectorConfig::ideal();
    for (name, config) in [("default", SequenceConfig::default()), ("ideal", ideal)] {
        let Ok(sequence) = Sequence::new(&config) else { continue };
        let mut index = 0;
        group.bench_function(name, |bencher| {
            bencher.iter(|| {
                // Every seventh frame: with and without people in view.
                index = (index + 7) % sequence.len();
                black_box(sequence.frame(index))
            });
        });
    }
    if let Ok(sequence) = Sequence::new(&SequenceConfig::default()) {
        let (mut index, mut scratch) = (0, FrameScratch::default());
        group.bench_function("recycled", |bencher| {
            bencher.iter(|| {
                index = (index + 7) % sequence.len();
                if let Some(frame) = black_box(sequence.frame_with(index, &mut scratch)) {
                    scratch.recycle(frame);
                }
            });
        });
    }
    group.finish();
}

/// Maps made of the exact visible points, each copy of which is shifted by up to some millimetres.
fn score(criterion: &mut Criterion) {
    let mut config = SequenceConfig::default();
    config.frames = 12;
    let Ok(sequence) = Sequence::new(&config) else { return };
    let Ok(truth) = Truth::of(&sequence, &TruthConfig::default()) else { return };
    let visible = truth.visible_points();
    let mut group = criterion.benchmark_group("dymlm-sim/score_cloud");
    group.sample_size(10);
    for size in SIZES {
        let point = |i: usize| visible[i % visible.len()].map(|c| c + (i % 17) as f32 * 0.001);
        let cloud = PointCloud::new((0..size).map(point).collect());
        group.throughput(Throughput::Elements(size as u64));
        group.bench_with_input(BenchmarkId::from_parameter(size), &cloud, |bencher, cloud| {
            bencher.iter(|| score_cloud(black_box(cloud), &truth));
        });
    }
    group.finish();
}

fn reference(criterion: &mut Criterion) {
    let camera = kinect();
    let Ok(frame) = Frame::new(0.0, camera, room_depth(), None) else { return };
    let Ok(mut reference) = ReferenceCloud::new(0.02) else { return };
    let mut group = criterion.benchmark_group("dymlm-sim/reference_cloud");
    group.throughput(Throughput::Elements(640 * 480)).sample_size(20);
    group.bench_function("add_frame", |bencher| {
        bencher.iter(|| reference.add_frame(black_box(&frame), &Pose::identity(), 0.3, 4.0));
    });
    group.finish();
}

criterion_group!(benches, frames, score, reference);
criterion_main!(benches);

//! Benches of the whole map: `MapBuilder::insert` on frames with people, also with a history and with a
//! reader; the cost of readers and of corrected poses.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm::core::Pose;
use dymlm::{HistoryConfig, MapBuilder, MapConfig};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

const FRAMES: usize = 30;

fn frames() -> Vec<SimulatedFrame> {
    let mut config = SequenceConfig::default();
    config.frames = FRAMES;
    Sequence::new(&config).unwrap().frames().collect()
}

fn mapped(frames: &[SimulatedFrame], config: &MapConfig, is_read: bool) -> MapBuilder {
    let mut builder = MapBuilder::new(config.clone()).unwrap();
    let reader = is_read.then(|| builder.reader());
    for frame in frames {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
    drop(reader);
    builder
}

fn with_history() -> MapConfig {
    let mut config = MapConfig::offline();
    config.history = HistoryConfig::Memory;
    config
}

fn insert(c: &mut Criterion) {
    let frames = frames();
    let mut group = c.benchmark_group("map/insert");
    group.sample_size(10).throughput(Throughput::Elements(frames.len() as u64));
    let ways = [
        ("30 frames of 640x480 with people", MapConfig::offline(), false),
        ("the same with a history", with_history(), false),
        ("the same with a reader", MapConfig::offline(), true),
    ];
    for (name, config, is_read) in ways {
        group.bench_function(name, |b| b.iter(|| mapped(&frames, &config, is_read)));
    }
    group.finish();
}

fn follow(c: &mut Criterion) {
    let frames = frames();
    let mut builder = mapped(&frames, &with_history(), false);
    let mut group = c.benchmark_group("map/follow");
    group.sample_size(10);
    group.bench_function("30 key frames at other poses", |b| {
        let step = Pose::new([0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        b.iter(|| builder.transform(&step).unwrap());
    });
    group.finish();
}

fn read(c: &mut Criterion) {
    let frames = frames();
    let (last, before) = frames.split_last().unwrap();
    let mut builder = mapped(before, &MapConfig::offline(), false);
    let mut group = c.benchmark_group("map/read");
    group.bench_function("publish", |b| {
        let reader = builder.reader();
        b.iter(|| builder.settle());
        drop(reader);
    });
    let earlier = builder.reader().latest();
    earlier.cloud().len();
    builder.insert(&last.frame, &last.detections, &last.world_from_camera).unwrap();
    let now = builder.reader().latest();
    now.cloud().len();
    group.bench_function("changes of a frame, the static cloud being known", |b| {
        b.iter(|| now.changes_since(&earlier));
    });
    group.finish();
}

criterion_group!(benches, insert, follow, read);
criterion_main!(benches);

//! Benches of the whole: `MapBuilder::insert` on frames with people.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm::{MapBuilder, MapConfig};
use dymlm_sim::{Sequence, SequenceConfig};

fn insert(c: &mut Criterion) {
    let mut config = SequenceConfig::default();
    config.frames = 30;
    let sequence = Sequence::new(&config).unwrap();
    let frames: Vec<_> = sequence.frames().collect();
    let mut group = c.benchmark_group("map/insert");
    group.sample_size(10).throughput(Throughput::Elements(frames.len() as u64));
    group.bench_function("30 frames of 640x480 with people", |b| {
        b.iter(|| {
            let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
            for frame in &frames {
                builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
            }
            builder
        });
    });
    group.finish();
}

criterion_group!(benches, insert);
criterion_main!(benches);

//! Benches of the history: packing an observation of a frame, and unpacking it again.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use dymlm_history::{History, HistoryConfig, Observation};
use dymlm_sim::{Sequence, SequenceConfig};

/// Observations of a room of 640x480, with colours.
fn observation() -> Arc<Observation> {
    let mut config = SequenceConfig::default();
    config.frames = 1;
    let sequence = Sequence::new(&config).unwrap();
    let simulated = sequence.frames().next().unwrap();
    Arc::new(Observation::of_frame(&simulated.frame).unwrap())
}

fn observations(c: &mut Criterion) {
    let observation = observation();
    let history = || History::new(&HistoryConfig::Memory).unwrap().unwrap();
    let mut group = c.benchmark_group("history");
    // The thread that packs is begun each time, some ten microseconds.
    group.bench_function("pack", |b| {
        b.iter(|| {
            let mut history = history();
            history.push(Arc::clone(&observation));
            history.settle();
            history
        });
    });
    let mut packed = history();
    let number = packed.push(Arc::clone(&observation));
    packed.settle();
    group.bench_function("unpack", |b| b.iter(|| black_box(packed.get(number).unwrap())));
    group.finish();
}

criterion_group!(benches, observations);
criterion_main!(benches);

//! Benches of `dymlm-core`.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{kinect, room_depth};
use dymlm_core::OrganizedCloud;

fn back_project(c: &mut Criterion) {
    let (camera, depth) = (kinect(), room_depth());
    let mut cloud = OrganizedCloud::new();
    let mut group = c.benchmark_group("core/back_project");
    group.throughput(Throughput::Elements(depth.data().len() as u64));
    group.bench_function("640x480", |b| b.iter(|| cloud.back_project(&camera, &depth).unwrap()));
    // For comparison, the cost of memory bandwidth alone: copying the same number of points.
    let points = cloud.points().to_vec();
    let mut copy = points.clone();
    group.bench_function("copy of 640x480 points", |b| b.iter(|| copy.copy_from_slice(&points)));
    group.finish();
}

criterion_group!(benches, back_project);
criterion_main!(benches);

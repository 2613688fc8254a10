//! Benches of `CloudMap`: a frame put in, the cloud taken out.

#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{kinect, room_depth};
use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{Frame, Pose, SensorModel};

/// A slow walk sideways.
fn pose(step: u32) -> Pose {
    let x = 0.3 * (f64::from(step) * 0.1).sin();
    Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
}

fn insert(c: &mut Criterion) {
    let frame = Frame::new(0.0, kinect(), room_depth(), None).unwrap();
    let mut group = c.benchmark_group("cloud_map/insert");
    group.throughput(Throughput::Elements(frame.depth().data().len() as u64));
    for frames_before in [0, 100, 1000] {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        (0..frames_before).for_each(|step| {
            map.insert(&frame, None, &pose(step)).unwrap();
        });
        let mut step = frames_before;
        group.bench_function(format!("after {frames_before} frames"), |b| {
            b.iter(|| {
                step += 1;
                map.insert(&frame, None, &pose(step)).unwrap()
            });
        });
    }
    group.finish();
}

fn point_cloud(c: &mut Criterion) {
    let frame = Frame::new(0.0, kinect(), room_depth(), None).unwrap();
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    (0..60).for_each(|step| {
        map.insert(&frame, None, &pose(step)).unwrap();
    });
    let mut group = c.benchmark_group("cloud_map/point_cloud");
    group.sample_size(10).throughput(Throughput::Elements(map.len() as u64));
    group.bench_function("static", |b| b.iter(|| map.point_cloud(Selection::Static)));
    group.finish();
}

criterion_group!(benches, insert, point_cloud);
criterion_main!(benches);

//! Benches of `CloudMap`: inserting a frame, reading the cloud. The kitchen recording is used if it is at
//! `DYMLM_DATA` or `../shared/data`.

#![allow(missing_docs, clippy::unwrap_used, clippy::print_stderr, reason = "a bench")]

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{kinect, room_depth};
use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{Frame, Pose, SensorModel};
use dymlm_io::{TumDataset, TumOptions};
use dymlm_test_support::recording;

/// A camera that slowly moves sideways to and fro.
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
    group.sample_size(10).throughput(Throughput::Elements(map.held_voxels() as u64));
    group.bench_function("static", |b| b.iter(|| map.point_cloud(Selection::Static)));
    group.finish();
}

/// The frames of the kitchen with people, if the recording is there.
fn kitchen() -> Option<Vec<(Frame, Pose)>> {
    let dataset = TumDataset::open(recording("kitchen_people")?, &TumOptions::default()).ok()?;
    let frames = (0..dataset.frames().len()).filter_map(|index| dataset.load(index).ok());
    Some(frames.map(|posed| (posed.frame, posed.world_from_camera)).collect())
}

/// The cost of the static cloud after each further frame of the kitchen, and of the frame itself, with and
/// without fused surfaces.
fn static_cloud_of_kitchen(c: &mut Criterion) {
    let Some(frames) = kitchen() else { return };
    for (name, fuse_surfaces) in [("cloud_map/kitchen", true), ("cloud_map/kitchen as read", false)] {
        let mut config = CloudMapConfig::default();
        config.fuse_surfaces = fuse_surfaces;
        static_cloud_of(c, name, config, &frames);
    }
}

fn static_cloud_of(c: &mut Criterion, name: &str, config: CloudMapConfig, frames: &[(Frame, Pose)]) {
    let (before, last) = frames.split_at(frames.len() - 40);
    let mut map = CloudMap::new(config, SensorModel::kinect()).unwrap();
    for (frame, world_from_camera) in before {
        map.insert(frame, None, world_from_camera).unwrap();
    }
    black_box(map.point_cloud(Selection::Static));
    // The last frames forwards and backwards, so that time goes on and the camera does not jump.
    let (mut time, mut turns) = (last[0].0.timestamp(), last.iter().chain(last.iter().rev()).cycle());
    let mut further = |map: &mut CloudMap| {
        let (frame, world_from_camera) = turns.next().unwrap();
        time += 1.0 / 30.0;
        let (depth, color) = frame.clone().into_images();
        let frame = Frame::new(time, *frame.camera(), depth, color).unwrap();
        let start = Instant::now();
        map.insert(&frame, None, world_from_camera).unwrap();
        start.elapsed()
    };
    let mut group = c.benchmark_group(name);
    group.sample_size(10);
    group.bench_function("one more frame", |b| {
        b.iter_custom(|turns| (0..turns).map(|_| further(&mut map)).sum());
    });
    // Copied as a whole, and where it is, as queries have it.
    let copied: fn(&CloudMap) -> usize = |map| map.point_cloud(Selection::Static).len();
    let in_place: fn(&CloudMap) -> usize = |map| map.static_points().len();
    let reads = [("cloud", copied), ("points", in_place)];
    for (what, read) in reads {
        group.bench_function(format!("static {what} after one more frame"), |b| {
            b.iter_custom(|turns| {
                let timed = |_| {
                    further(&mut map);
                    let start = Instant::now();
                    black_box(read(&map));
                    start.elapsed()
                };
                (0..turns).map(timed).sum()
            });
        });
    }
    group.finish();
    eprintln!("{} voxels, {} bytes", map.held_voxels(), map.memory_bytes());
}

criterion_group!(benches, insert, point_cloud, static_cloud_of_kitchen);
criterion_main!(benches);

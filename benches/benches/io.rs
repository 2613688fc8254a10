//! Reading and writing of clouds, and loading of dataset frames.
#![allow(clippy::unwrap_used, reason = "a bench that cannot read its input has nothing to measure")]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use dymlm_benches::{SIZES, blobs, kinect, room_depth};
use dymlm_core::PointCloud;
use dymlm_io::{
    FrameBuffers, StampedPose, Trajectory, TumDataset, TumOptions, decode_pcd, decode_ply, encode_pcd,
    encode_ply, write_depth_png, write_png,
};

fn colored(n: usize) -> PointCloud {
    let colors = (0..n).map(|i| [i as u8, (i >> 8) as u8, (i >> 16) as u8]).collect();
    PointCloud::with_colors(blobs(n), colors).unwrap()
}

fn ply(c: &mut Criterion) {
    for (name, write) in [("io/write_ply", true), ("io/read_ply", false)] {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        for n in SIZES {
            let cloud = colored(n);
            let mut bytes = Vec::new();
            encode_ply(&mut bytes, &cloud).unwrap();
            group.throughput(Throughput::Elements(n as u64));
            group.bench_function(BenchmarkId::from_parameter(n), |b| {
                if write {
                    b.iter(|| {
                        bytes.clear();
                        encode_ply(&mut bytes, &cloud).unwrap();
                    });
                } else {
                    b.iter(|| black_box(decode_ply(&bytes, "bench").unwrap()));
                }
            });
        }
    }
}

fn pcd(c: &mut Criterion) {
    let n = 100_000;
    let cloud = colored(n);
    let mut bytes = Vec::new();
    encode_pcd(&mut bytes, &cloud).unwrap();
    let mut group = c.benchmark_group("io/pcd_binary");
    group.sample_size(10).throughput(Throughput::Elements(n as u64));
    group.bench_function("read", |b| b.iter(|| black_box(decode_pcd(&bytes, "bench").unwrap())));
    group.bench_function("write", |b| {
        let mut out = Vec::new();
        b.iter(|| {
            out.clear();
            encode_pcd(&mut out, &cloud).unwrap();
        });
    });
}

/// A frame of 640x480: a 16-bit depth PNG and a colour PNG.
fn frame(c: &mut Criterion) {
    let folder = std::env::temp_dir().join(format!("dymlm-bench-io-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (camera, depth) = (kinect(), room_depth());
    let colors: Vec<_> = depth.data().iter().map(|&z| [(60.0 * z) as u8, 128, (z * 1e3) as u8]).collect();
    write_depth_png(folder.join("depth.png"), &depth, 5000.0).unwrap();
    write_png(folder.join("rgb.png"), camera.width(), camera.height(), &colors).unwrap();
    std::fs::write(folder.join("associations.txt"), "0 rgb.png 0 depth.png\n").unwrap();
    std::fs::write(
        folder.join("camera.json"),
        r#"{"width": 640, "height": 480, "fx": 525, "fy": 525, "cx": 319.5, "cy": 239.5, "depth_scale": 5000}"#,
    )
    .unwrap();
    let pose = StampedPose { timestamp: 0.0, world_from_camera: dymlm_core::Pose::identity() };
    Trajectory::new(vec![pose]).unwrap().write(folder.join("groundtruth.txt")).unwrap();

    let dataset = TumDataset::open(&folder, &TumOptions::default()).unwrap();
    let mut buffers = FrameBuffers::default();
    let mut group = c.benchmark_group("io/load_frame");
    group.throughput(Throughput::Elements(640 * 480)).bench_function("640x480", |b| {
        b.iter(|| {
            let posed = dataset.load_into(0, &mut buffers).unwrap();
            buffers.recycle(black_box(posed).frame);
        });
    });
    group.finish();
    std::fs::remove_dir_all(&folder).ok();
}

criterion_group!(benches, ply, pcd, frame);
criterion_main!(benches);

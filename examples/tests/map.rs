//! `map` as a program: maps of several sessions become one.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::Path;
use std::process::{Command, Output};

use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap};

/// None where the program is not built: `cargo test` of the whole package builds it.
fn map(arguments: &[&str]) -> Option<Output> {
    let deps = std::env::current_exe().unwrap();
    let name = format!("map{}", std::env::consts::EXE_SUFFIX);
    let program = deps.parent()?.parent()?.join("examples").join(name);
    if !program.exists() {
        println!("skipped: {} is not built", program.display());
        return None;
    }
    Some(Command::new(program).args(arguments).output().unwrap())
}

/// A wall at two metres, seen at two times.
fn save_map(folder: &Path, start: f64, voxel_size: f64) {
    let mut config = MapConfig::default();
    config.history = HistoryConfig::Memory;
    config.cloud.voxel_size = voxel_size;
    let mut builder = MapBuilder::new(config).unwrap();
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    for time in [start, start + 1.0] {
        let wall = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
        let frame = Frame::new(time, camera, wall, None).unwrap();
        builder.insert(&frame, &[], &Pose::identity()).unwrap();
    }
    builder.into_map().save(folder).unwrap();
}

#[test]
fn maps_of_two_sessions_become_one() {
    let parent = tempfile::tempdir().unwrap();
    let path = |name: &str| parent.path().join(name).to_str().unwrap().to_owned();
    let (one, other, coarse, out) = (path("one"), path("other"), path("coarse"), path("out"));
    save_map(one.as_ref(), 100.0, 0.01);
    save_map(other.as_ref(), 200.0, 0.01);
    save_map(coarse.as_ref(), 300.0, 0.02);
    let poses = path("poses.txt");
    std::fs::write(&poses, "# tx ty tz qx qy qz qw\n0 0 0 0 0 0 1\n0 0 5 0 0 0 1\n").unwrap();

    let Some(done) = map(&["merge", &one, &other, "--out", &out, "--poses", &poses]) else { return };
    assert!(done.status.success(), "{done:?}");
    let merged = MultiLevelMap::load(&out).unwrap();
    assert_eq!(merged.sessions().len(), 2);
    let single = MultiLevelMap::load(&one).unwrap().counts();
    assert_eq!(merged.counts().cloud_points, 2 * single.cloud_points);
    let said = String::from_utf8(map(&["info", &out]).unwrap().stdout).unwrap();
    assert!(said.contains("2 frames from frame 2 on, 200.0 s to 201.0 s"), "{said}");

    let refused = map(&["merge", &one, &coarse, "--out", &path("none")]).unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("cloud.voxel_size is 0.01 and 0.02"), "{said}");
    assert!(!Path::new(&path("none")).exists());
    std::fs::write(&poses, "0 0 0 0 0 0 1\n").unwrap();
    let refused = map(&["merge", &one, &other, "--out", &out, "--poses", &poses]).unwrap();
    assert!(String::from_utf8(refused.stderr).unwrap().contains("1 poses for 2 maps"));
}

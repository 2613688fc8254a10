//! Tests of the program `map`: maps of several sessions are merged, floors become grids.

use std::path::Path;
use std::process::{Command, Output};

use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
use dymlm::{HistoryConfig, MapBuilder, MapConfig, MultiLevelMap};
use dymlm_test_support::{Rectangle, World, look_at, small_camera};

use crate::example_program::example_program;

/// Runs the program; `None` if it is not built.
fn map(arguments: &[&str]) -> Option<Output> {
    Some(Command::new(example_program("map")?).args(arguments).output().unwrap())
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
    // What cannot take the result is refused before anything is loaded.
    std::fs::create_dir(path("taken")).unwrap();
    std::fs::write(path("taken/notes.txt"), "").unwrap();
    let refused = map(&["merge", &one, &path("none"), "--out", &path("taken")]).unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("taken") && !said.contains("none"), "{said}");
    std::fs::write(&poses, "0 0 0 0 0 0 1\n").unwrap();
    let refused = map(&["merge", &one, &other, "--out", &out, "--poses", &poses]).unwrap();
    assert!(String::from_utf8(refused.stderr).unwrap().contains("1 poses for 2 maps"));
}

/// Saves a map of two floors, each with a wall, seen one after the other by a camera that looks ahead.
/// The config says what is up, as nothing stands there from which it could be learnt.
fn save_storeys(folder: &Path) {
    save_storeys_in(folder, &Pose::identity(), Some([0.0, 0.0, 1.0]));
}

/// The same in a world that may be turned, with what its config says of up.
fn save_storeys_in(folder: &Path, world_from_storeys: &Pose, up: Option<[f64; 3]>) {
    let mut config = MapConfig::offline();
    config.objects.parameterization.up = up;
    let mut builder = MapBuilder::new(config).unwrap();
    let camera = small_camera();
    let mut time = 0.0;
    for floor in [0.0, 2.8] {
        let world = World::of(&[
            Rectangle::level([0.0, -0.5, floor], 3.0, 2.5),
            Rectangle::upright([0.0, 2.0, floor + 1.0], 3.0, 1.0),
        ]);
        for step in 0..4 {
            let eye = look_at([0.02 * f64::from(step), -2.0, floor + 1.4], [0.0, 1.0, floor]);
            let frame = Frame::new(time, camera, world.depth(&camera, &eye), None).unwrap();
            builder.insert(&frame, &[], &(*world_from_storeys * eye)).unwrap();
            time += 1.0;
        }
    }
    builder.into_map().save(folder).unwrap();
}

#[test]
fn each_floor_has_a_grid() {
    let parent = tempfile::tempdir().unwrap();
    let path = |name: &str| parent.path().join(name).to_str().unwrap().to_owned();
    save_storeys(path("map").as_ref());
    let Some(done) = map(&["grid", &path("map"), "--out", &path("all.yaml"), "--floors"]) else { return };
    assert!(done.status.success(), "{done:?}");
    let said = String::from_utf8(done.stdout).unwrap();
    assert!(said.lines().count() == 2 && said.contains("all_1.yaml"), "{said}");
    let pixels = |name: &str| {
        let image = std::fs::read(path(name)).unwrap();
        let size = image.split(|&byte| byte == b'\n').nth(1).unwrap().to_vec();
        let size: Vec<usize> =
            String::from_utf8(size).unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
        (size[0], image[image.len() - size[0] * size[1]..].to_vec())
    };
    // The wall is a row of occupied cells at y = 2, and nothing else is in the way.
    for name in ["all_0.pgm", "all_1.pgm"] {
        let (width, image) = pixels(name);
        let occupied: Vec<usize> = (0..image.len()).filter(|&index| image[index] == 0).collect();
        assert!(
            occupied.len() > 40 && occupied.iter().all(|index| index / width < 3),
            "{name}: {occupied:?}"
        );
    }
    let arguments = ["--at", "0", "0", "4", "--region", "-1", "1", "1", "4", "--inflate", "0.3"];
    let done = map(&[&["grid", &path("map"), "--out", &path("one.yaml")], &arguments[..]].concat()).unwrap();
    assert!(done.status.success(), "{done:?}");
    let (width, image) = pixels("one.pgm");
    assert_eq!((width, image.len()), (40, 40 * 60));
    // 0.3 m before the wall.
    let column: Vec<u8> = image.chunks(40).map(|row| row[20]).collect();
    let nearest = column.iter().rposition(|&pixel| pixel == 0).unwrap();
    let y = 4.0 - 0.05 * (nearest as f64 + 0.5);
    assert!((y - 1.72).abs() < 0.06, "{y}");
    // A region that ends before the wall has the wall's margin all the same: it is the lower part of the other.
    let arguments = ["--at", "0", "0", "4", "--region", "-1", "1", "1", "1.9", "--inflate", "0.3"];
    let done = map(&[&["grid", &path("map"), "--out", &path("part.yaml")], &arguments[..]].concat()).unwrap();
    assert!(done.status.success(), "{done:?}");
    let (width, part) = pixels("part.pgm");
    assert_eq!((width, part.len()), (40, 40 * 18));
    assert!(part == image[image.len() - part.len()..] && part[20] == 0);
    let yaml = std::fs::read_to_string(path("one.yaml")).unwrap();
    assert!(yaml.contains("image: \"one.pgm\"") && yaml.contains("origin: [-1, 1, 0.0]"), "{yaml}");
    let refused = map(&["grid", &path("map"), "--at", "0", "0", "-3"]).unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("no floor is known under [0.0, 0.0, -3.0]"), "{said}");
}

/// The worlds of cameras that look ahead have y downwards.
#[test]
fn up_is_what_the_map_knows_or_what_is_given() {
    let parent = tempfile::tempdir().unwrap();
    let path = |name: &str| parent.path().join(name).to_str().unwrap().to_owned();
    let about_x = Pose::new([0.0; 3], [0.5_f64.sqrt(), 0.0, 0.0, 0.5_f64.sqrt()]).unwrap();
    save_storeys_in(path("known").as_ref(), &about_x, Some([0.0, -1.0, 0.0]));
    save_storeys_in(path("unknown").as_ref(), &about_x, None);
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let Some(done) = map(&["grid", &path("known"), "--out", &path("known.yaml"), "--floors"]) else { return };
    assert!(done.status.success() && String::from_utf8_lossy(&done.stdout).lines().count() == 2, "{done:?}");
    let done = map(&["gltf", &path("known"), "--out", &path("known.glb")]).unwrap();
    assert!(done.status.success(), "{done:?}");

    let (yaml, glb) = (path("unknown.yaml"), path("unknown.glb"));
    let (grid, gltf) =
        (["grid", &path("unknown"), "--out", &yaml], ["gltf", &path("unknown"), "--out", &glb]);
    for (command, file) in [(&grid, "unknown.pgm"), (&gltf, "unknown.glb")] {
        let refused = map(command).unwrap();
        assert!(!refused.status.success() && said(&refused).contains("--up"), "{refused:?}");
        assert!(!Path::new(&path(file)).exists());
        let done = map(&[&command[..], &["--up", "0", "-1", "0"]].concat()).unwrap();
        assert!(done.status.success() && Path::new(&path(file)).exists(), "{done:?}");
    }
    // The files of the map with a known direction are the same.
    assert_eq!(std::fs::read(path("unknown.glb")).unwrap(), std::fs::read(path("known.glb")).unwrap());
}

//! Tests of the program `build_map`: its output, how it treats broken frames, and that it never leaves a
//! partial output.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use dymlm::core::{ColorImage, DepthImage, Pose};
use dymlm::{MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_examples::{every, named_sequence};
use dymlm_io::{
    FrameBuffers, MapFolder, McapOptions, McapRecording, StampedPose, Trajectory, read_color_image,
    write_depth_png, write_png,
};
use dymlm_sim::Sequence;
use serde_json::Value;

use crate::example_program::example_program;

const FRAMES: usize = 6;
const WIDTH: usize = 64;
const HEIGHT: usize = 48;

fn build_map(arguments: &[&str]) -> Option<Output> {
    Some(Command::new(example_program("build_map")?).args(arguments).output().unwrap())
}

/// A wall at 2 m, seen in six frames from the same place.
fn write_dataset(folder: &Path) {
    let (mut rgb, mut depth) = (String::new(), String::new());
    let mut poses = Vec::new();
    for index in 0..FRAMES {
        let timestamp = index as f64 * 0.1;
        let color = ColorImage::new(WIDTH, HEIGHT, vec![[90, 120, 60]; WIDTH * HEIGHT]).unwrap();
        write_png(folder.join(format!("{index}_rgb.png")), WIDTH, HEIGHT, color.data()).unwrap();
        let wall = DepthImage::new(WIDTH, HEIGHT, vec![2.0; WIDTH * HEIGHT]).unwrap();
        write_depth_png(folder.join(format!("{index}_depth.png")), &wall, 5000.0).unwrap();
        writeln!(rgb, "{timestamp:.3} {index}_rgb.png").unwrap();
        writeln!(depth, "{timestamp:.3} {index}_depth.png").unwrap();
        poses.push(StampedPose { timestamp, world_from_camera: Pose::identity() });
    }
    fs::write(folder.join("rgb.txt"), rgb).unwrap();
    fs::write(folder.join("depth.txt"), depth).unwrap();
    Trajectory::new(poses).unwrap().write(folder.join("groundtruth.txt")).unwrap();
    let camera =
        r#"{"width": 64, "height": 48, "fx": 52.5, "fy": 52.5, "cx": 31.5, "cy": 23.5, "depth_scale": 5000}"#;
    fs::write(folder.join("camera.json"), camera).unwrap();
}

fn paths() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let (dataset, out) = (parent.path().join("dataset"), parent.path().join("map"));
    fs::create_dir(&dataset).unwrap();
    write_dataset(&dataset);
    (parent, dataset, out)
}

#[test]
fn a_broken_frame_costs_a_warning_and_a_count() {
    let (_parent, dataset, out) = paths();
    // A truncated image, a missing one, one of a different size, and a bad line of detections.
    let bytes = fs::read(dataset.join("1_depth.png")).unwrap();
    fs::write(dataset.join("1_depth.png"), &bytes[..bytes.len() / 2]).unwrap();
    fs::remove_file(dataset.join("2_rgb.png")).unwrap();
    write_depth_png(dataset.join("3_depth.png"), &DepthImage::new(2, 2, vec![1.0; 4]).unwrap(), 5000.0)
        .unwrap();
    let good = |t: f64| format!("{{\"timestamp\": {t:.1}, \"detections\": []}}\n");
    let lines =
        [good(0.0), good(0.1), good(0.2), good(0.3), "{\"timestamp\": 0.4, \"detect\n".into(), good(0.5)];
    fs::write(dataset.join("detections.jsonl"), lines.concat()).unwrap();

    let (dataset, out_name) = (dataset.to_str().unwrap(), out.to_str().unwrap());
    let Some(output) = build_map(&["--dataset", dataset, "--out", out_name]) else { return };
    let warnings = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{warnings}");
    for named in ["1_depth.png", "2_rgb.png", "3_depth.png", "detections.jsonl, line 5"] {
        assert!(warnings.contains(named), "{named} in {warnings}");
    }

    // Of frames that were never mapped, no pose is listed.
    let trajectory = Trajectory::read(out.join("trajectory.txt")).unwrap();
    let times: Vec<f64> = trajectory.poses().iter().map(|pose| pose.timestamp).collect();
    assert_eq!(times, [0.0, 0.5]);

    let report = fs::read_to_string(out.join("report.json")).unwrap();
    assert!(report.contains("\"frames\": 6") && report.contains("\"frames_skipped\": 4"), "{report}");
    assert!(
        ["\"insert\"", "\"median_ms\"", "\"p95_ms\"", "\"max_ms\"", "\"peak_memory_bytes\"", "\"config\""]
            .iter()
            .all(|key| report.contains(key))
    );
    let map = MapFolder::open(&out).unwrap();
    let files: Vec<&str> = map.files().collect();
    for name in ["cloud.ply", "octree.bt", "octree.ot", "cloud_above.png", "octree_side.png"] {
        assert!(files.contains(&name), "{files:?}");
    }
    assert!(!dymlm_io::read_ply(out.join("cloud.ply")).unwrap().is_empty());
}

#[test]
fn a_run_that_fails_leaves_nothing() {
    let (parent, dataset, out) = paths();
    let entries = || fs::read_dir(parent.path()).unwrap().count();
    let before = entries();
    // No frame can be read.
    for index in 0..FRAMES {
        fs::write(dataset.join(format!("{index}_depth.png")), b"no image").unwrap();
    }
    let (dataset, out_name) = (dataset.to_str().unwrap(), out.to_str().unwrap());
    let Some(output) = build_map(&["--dataset", dataset, "--out", out_name]) else { return };
    assert!(!output.status.success());
    assert!(!out.exists());
    assert_eq!(entries(), before, "no temporary folder is left");

    // A config with a field that does not exist, and one out of range.
    for (config, named) in
        [("[cloud]\nvoxel_sise = 0.1\n", "voxel_sise"), ("[cloud]\nvoxel_size = 0.0\n", "voxel_size")]
    {
        let path = parent.path().join("config.toml");
        fs::write(&path, config).unwrap();
        let arguments = ["--dataset", dataset, "--out", out_name, "--config", path.to_str().unwrap()];
        let Some(output) = build_map(&arguments) else { return };
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && error.contains(named), "{error}");
        fs::remove_file(path).unwrap();
    }
    assert_eq!(entries(), before);
}

/// Bags of 8x6 pixels made by independent writers: `dymlm-io/tests/bags/write_bags.py`.
fn bag(name: &str) -> String {
    format!("{}/../dymlm-io/tests/bags/{name}.mcap", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_bag_gives_the_maps_of_its_frames() {
    let out = tempfile::tempdir().unwrap();
    let run = |name: &str, more: &[&str]| {
        let folder = out.path().join(name);
        let bag = bag(name);
        let output =
            build_map(&[&["--dataset", &bag, "--out", folder.to_str().unwrap()][..], more].concat())?;
        Some((folder, output.status.success(), String::from_utf8(output.stderr).unwrap()))
    };
    let Some((folder, done, warnings)) = run("plain", &[]) else { return };
    assert!(done, "{warnings}");
    // The same frames, mapped without the program.
    let mut recording = McapRecording::open(bag("plain"), &McapOptions::default()).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    let mut buffers = FrameBuffers::default();
    for index in 0..recording.frames().len() {
        let loaded = recording.load(index, &mut buffers).unwrap();
        builder.insert(&loaded.frame, loaded.detections.as_deref(), &loaded.world_from_camera).unwrap();
    }
    builder.settle();
    let map = MultiLevelMap::load(&folder).unwrap();
    let points = |map: &MultiLevelMap| map.cloud().point_cloud(Selection::All).points().to_vec();
    assert!(points(&map).len() > 20 && points(&map) == points(builder.map()));
    assert_eq!(map.cloud().frames(), 4);

    // A frame without a pose gives a warning; a missing topic, or detections from a file, end the run.
    let (folder, done, warnings) = run("late_tf", &[]).unwrap();
    assert!(done && warnings.contains("frame 0 skipped"), "{warnings}");
    assert_eq!(MultiLevelMap::load(folder).unwrap().cloud().frames(), 3);
    // A bag whose classes are numbers; class 1 has no name in the shorter list.
    for (names, skipped) in [("person\nchair\n", false), ("person\n", true)] {
        let file = out.path().join("names.txt");
        fs::write(&file, names).unwrap();
        let (_, _, warnings) = run("numbered", &["--class-names", file.to_str().unwrap()]).unwrap();
        assert_eq!(warnings.contains("class 1 of 1 names"), skipped, "{warnings}");
    }
    for (refused, named) in
        [(["--topics", "depth=/nowhere"], "/nowhere"), (["--detections", "x"], "a bag contains its own")]
    {
        let (folder, done, error) = run("odometry", &refused).unwrap();
        assert!(!done && error.contains(named) && !folder.join("report.json").exists(), "{error}");
    }
}

/// The workspace has no dependencies of detectors; the program with a detector is in `examples/detect`.
#[test]
fn without_a_detector_it_says_which_program_has_one() {
    let (_parent, dataset, out) = paths();
    let [dataset, out_name] = [&dataset, &out].map(|path| path.to_str().unwrap());
    let arguments = ["--dataset", dataset, "--out", out_name, "--detector", "yolox_nano.onnx"];
    let Some(output) = build_map(&arguments) else { return };
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(
        !output.status.success() && error.contains("examples/detect/Cargo.toml --bin build_map"),
        "{error}"
    );
    assert!(!out.exists());
}

fn page_data(page: &str) -> Value {
    let (_, data) = page.split_once("id=\"page-data\">").unwrap();
    serde_json::from_str(data.split_once("</script>").unwrap().0).unwrap()
}

/// A correction moves the maps; what they hold is drawn on a frame from where its camera then was.
#[test]
fn pictures_are_taken_from_the_corrected_poses() {
    let (parent, dataset, out) = paths();
    let moved = |index: usize| StampedPose {
        timestamp: index as f64 * 0.1,
        world_from_camera: Pose::new([3.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
    };
    let poses = parent.path().join("corrections.txt");
    Trajectory::new((0..FRAMES).map(moved).collect()).unwrap().write(&poses).unwrap();
    let corrected = parent.path().join("corrected");
    let [dataset, out, corrected, poses] =
        [&dataset, &out, &corrected, &poses].map(|path| path.to_str().unwrap());
    let Some(run) = build_map(&["--dataset", dataset, "--out", out]) else { return };
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let run = build_map(&["--dataset", dataset, "--out", corrected, "--corrections", poses]).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(MultiLevelMap::load(corrected).unwrap().planes().len(), 1);
    let [before, after] =
        [out, corrected].map(|folder| read_color_image(Path::new(folder).join("planes_camera.png")).unwrap());
    assert!(before.data().iter().any(|&color| color != [90, 120, 60]), "the wall is drawn");
    let others = before.data().iter().zip(after.data()).filter(|(a, b)| a != b).count();
    assert!(others < WIDTH * HEIGHT / 50, "{others} pixels differ");
}

/// A run that comes to nothing leaves the map of the run before, also where its session file lies beside that
/// map.
#[test]
fn a_run_that_fails_leaves_the_map_beside_its_session_file() {
    let (_parent, dataset, out) = paths();
    let session = out.join("session.mcap");
    let [dataset_name, out_name, session] = [&dataset, &out, &session].map(|path| path.to_str().unwrap());
    let Some(run) = build_map(&["--dataset", dataset_name, "--out", out_name]) else { return };
    assert!(run.status.success());
    for index in 0..FRAMES {
        fs::write(dataset.join(format!("{index}_depth.png")), b"no image").unwrap();
    }
    let run = build_map(&["--dataset", dataset_name, "--out", out_name, "--mcap", session]).unwrap();
    assert!(!run.status.success());
    assert!(MultiLevelMap::load(&out).unwrap().cloud().frames() > 0);
}

#[test]
fn a_second_run_goes_on_with_the_maps_of_the_first() {
    let (parent, dataset, out) = paths();
    let second = parent.path().join("second");
    let [dataset, out, second] = [&dataset, &out, &second].map(|path| path.to_str().unwrap());
    let Some(first_run) = build_map(&["--dataset", dataset, "--out", out]) else { return };
    assert!(first_run.status.success());
    // The same recording, whose clock restarts, with its world a metre beside the first.
    let beside = ["--resume", out, "--world-from-session", "-1 0 0 0 0 0 1", "--report"];
    let run = build_map(&[&["--dataset", dataset, "--out", second][..], &beside].concat()).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let [before, after] = [out, second].map(|folder| MultiLevelMap::load(folder).unwrap());
    assert!(after.cloud().len() > before.cloud().len() * 5 / 4);
    assert_eq!(after.cloud().frames(), before.cloud().frames() * 2);
    let trajectory = Trajectory::read(Path::new(second).join("trajectory.txt")).unwrap();
    assert_eq!(trajectory.poses().len(), FRAMES);
    assert!(trajectory.poses().iter().all(|pose| pose.world_from_camera.translation() == [-1.0, 0.0, 0.0]));
    // The times on its page are those of the maps' clock, which has gone on.
    let page = fs::read_to_string(Path::new(second).join("report.html")).unwrap();
    let data = page_data(&page);
    let wall = &data["planes"][0];
    assert_eq!((data["start"].as_f64(), wall["first_seen"].as_f64()), (Some(10.5), Some(0.0)), "{wall}");
    assert_eq!(data["cloud"]["count"], after.cloud().len());
    assert!(MapFolder::open(second).unwrap().files().any(|name| name == "report.html"));
    // What is up in this sequence's world is told in the maps' world: turned by a right angle about z.
    let turned = parent.path().join("turned");
    let turned = turned.to_str().unwrap();
    let about_z = ["--resume", out, "--world-from-session", "0 0 0 0 0 0.70710678 0.70710678", "--report"];
    let run = build_map(&[&["--dataset", dataset, "--out", turned][..], &about_z].concat()).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let data = page_data(&fs::read_to_string(Path::new(turned).join("report.html")).unwrap());
    let up: Vec<f64> = serde_json::from_value(data["up"].clone()).unwrap();
    assert!((up[0] - 1.0).abs() < 1e-6, "{up:?}");
    // The output may also be the folder that is resumed.
    let run = build_map(&["--dataset", dataset, "--out", out, "--resume", out]).unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(MultiLevelMap::load(out).unwrap().cloud().frames(), after.cloud().frames());
}

/// Another machine has no folder of the first one's name, and more memory or less.
#[test]
fn maps_go_on_on_another_machine() {
    let (parent, dataset, out) = paths();
    let [there, here] = ["there", "here"].map(|name| parent.path().join(name));
    let configured = |name: &str, text: String| {
        let path = parent.path().join(name);
        fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let kept_in = |folder: &Path| {
        let folder = folder.display();
        format!("[history]\nfolder = '{folder}'\n[memory]\nbudget = 100_000_000\npath = '{folder}'\n")
    };
    let first = configured("first.toml", format!("{}[cloud]\nvoxel_size = 0.05\n", kept_in(&there)));
    let other = configured("other.toml", kept_in(&here));
    let smaller = configured("smaller.toml", "[cloud]\nvoxel_size = 0.01\n".to_owned());
    fs::create_dir(&there).unwrap();
    let [dataset, out_name] = [&dataset, &out].map(|path| path.to_str().unwrap());
    let mapping = ["--dataset", dataset, "--out", out_name];
    let Some(run) = build_map(&[&mapping[..], &["--config", &first]].concat()) else { return };
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let before = MultiLevelMap::load(&out).unwrap().cloud().frames();
    fs::remove_dir(&there).unwrap();
    fs::create_dir(&here).unwrap();
    let resumed =
        |config: &[&str]| build_map(&[&mapping[..], &["--resume", out_name], config].concat()).unwrap();
    let refused = resumed(&[]);
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("there"));
    // What the maps have been made with stays.
    let refused = resumed(&["--config", &smaller]);
    assert!(
        !refused.status.success()
            && String::from_utf8_lossy(&refused.stderr).contains("unknown field `cloud`")
    );
    let run = resumed(&["--config", &other]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let map = MultiLevelMap::load(&out).unwrap();
    assert_eq!(map.cloud().frames(), 2 * before);
    assert_eq!((map.config().cloud.voxel_size, map.config().memory.path.as_ref()), (0.05, Some(&here)));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_ends_with_the_map_of_what_it_has() {
    let (_parent, _dataset, out) = paths();
    let Some(program) = example_program("build_map") else { return };
    // The sequence is long enough to be interrupted in any case.
    let arguments = ["--sequence", "walking_xyz", "--autosave", "0.1", "--out", out.to_str().unwrap()];
    let mut run = Command::new(program).args(arguments).stderr(Stdio::piped()).spawn().unwrap();
    while MultiLevelMap::load(&out).is_err() {
        assert!(run.try_wait().unwrap().is_none(), "it has ended by itself");
        std::thread::sleep(Duration::from_millis(20));
    }
    let interrupt = Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap();
    assert!(interrupt.success());
    let output = run.wait_with_output().unwrap();
    let warnings = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && warnings.contains("interrupted after"), "{warnings}");
    let report: Value = serde_json::from_slice(&fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["frames_skipped"], 0, "{report}");
    assert!(report["frames_not_reached"].as_u64() > Some(0), "{report}");
    let map = MultiLevelMap::load(&out).unwrap();
    assert!(
        map.cloud().frames() > 0 && out.join("report.json").exists() && out.join("cloud_above.png").exists()
    );
}

#[test]
fn a_session_is_recorded_and_can_be_mapped_again() {
    let (parent, dataset, out) = paths();
    fs::write(dataset.join("detections.jsonl"), "{\"timestamp\": 0.1, \"detections\": []}\n").unwrap();
    let (session, again) = (parent.path().join("session.mcap"), parent.path().join("again"));
    let text = |path: &Path| path.to_str().unwrap().to_owned();
    let [dataset, out_name, session, again_name] = [&dataset, &out, &session, &again].map(|path| text(path));
    let first = ["--dataset", &dataset, "--out", &out_name, "--mcap", &session];
    let Some(output) = build_map(&first) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let output = build_map(&["--dataset", &session, "--out", &again_name]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let cloud = |folder: &Path| dymlm_io::read_ply(folder.join("cloud.ply")).unwrap();
    assert_eq!(cloud(&out).points(), cloud(&again).points());

    // Another name of the file that is read; it stays as it was, and nothing is written.
    let recorded = fs::read(&session).unwrap();
    let same = format!("{}/dataset/../session.mcap", parent.path().display());
    let nothing = text(&parent.path().join("nothing"));
    let output = build_map(&["--dataset", &session, "--out", &nothing, "--mcap", &same]).unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && error.contains("--mcap") && error.contains("would destroy"),
        "{error}"
    );
    assert!(fs::read(&session).unwrap() == recorded && !Path::new(&nothing).exists());

    // A file that cannot be written is reported before anything is mapped.
    let nowhere = text(&parent.path().join("none/session.mcap"));
    let output = build_map(&["--dataset", &dataset, "--out", &out_name, "--mcap", &nowhere]).unwrap();
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("session.mcap"));
}

/// Regression: the session's file made of an empty folder one that could not become a map, and all was lost.
#[test]
fn a_session_in_the_folder_of_the_map_stays_beside_it() {
    let (_parent, dataset, out) = paths();
    for is_made in [true, false] {
        if is_made {
            fs::create_dir(&out).unwrap();
        }
        let session = out.join("session.mcap");
        let [dataset, out_name, session_name] = [&dataset, &out, &session].map(|path| path.to_str().unwrap());
        let arguments = ["--dataset", dataset, "--out", out_name, "--mcap", session_name];
        let Some(run) = build_map(&arguments) else { return };
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        assert!(MultiLevelMap::load(&out).unwrap().cloud().frames() > 0);
        assert!(!McapRecording::open(&session, &McapOptions::default()).unwrap().frames().is_empty());
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn corrections_of_another_time_are_refused_before_anything_is_mapped() {
    let (parent, dataset, out) = paths();
    let later = |index: usize| StampedPose {
        timestamp: 1e9 + index as f64 * 0.1,
        world_from_camera: Pose::identity(),
    };
    let poses = parent.path().join("corrections.txt");
    Trajectory::new((0..FRAMES).map(later).collect()).unwrap().write(&poses).unwrap();
    let [dataset, out_name, poses] = [&dataset, &out, &poses].map(|path| path.to_str().unwrap());
    let arguments = ["--dataset", dataset, "--out", out_name, "--corrections", poses];
    let Some(run) = build_map(&arguments) else { return };
    let error = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && error.contains("times of the corrections"), "{error}");
    assert!(!out.exists());
}

/// Regression: up was what is above in the images on average, whatever the config said or the maps had
/// learnt.
#[test]
fn up_is_what_the_maps_know() {
    let (parent, dataset, out) = paths();
    let config = parent.path().join("up.toml");
    fs::write(&config, "[objects.parameterization]\nup = [1.0, 0.0, 0.0]\n").unwrap();
    let [dataset, out_name, config] = [&dataset, &out, &config].map(|path| path.to_str().unwrap());
    let arguments = ["--dataset", dataset, "--out", out_name, "--config", config, "--report"];
    let Some(run) = build_map(&arguments) else { return };
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let data = page_data(&fs::read_to_string(out.join("report.html")).unwrap());
    assert_eq!(data["up"], serde_json::json!([1.0, 0.0, 0.0]));
}

#[test]
fn poses_are_refined_before_the_map_is_written() {
    let (_parent, _, out) = paths();
    let out_name = out.to_str().unwrap();
    let arguments = ["--sequence", "walking_xyz", "--every", "30", "--refine", "--out", out_name];
    let Some(output) = build_map(&arguments) else { return };
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && printed.starts_with("refined in 1 rounds"), "{output:?}");
    let report: Value = serde_json::from_slice(&fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["refinement"]["key_frames"], 5);
    // The poses were right: within the noise of the walls they stay.
    let sequence = Sequence::new(&every(named_sequence("walking_xyz").unwrap().config, 30)).unwrap();
    let refined = Trajectory::read(out.join("trajectory.txt")).unwrap();
    assert_eq!(refined.poses().len(), sequence.len());
    for (index, pose) in refined.poses().iter().enumerate() {
        let moved = sequence.world_from_camera(index).inverse() * pose.world_from_camera;
        assert!(moved.translation().iter().all(|c| c.abs() < 0.01), "frame {index}: {moved:?}");
    }
}

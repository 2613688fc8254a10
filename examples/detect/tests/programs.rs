//! Tests of the programs `detect` and `build_map`, on a recording and with a network made here.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use common::{BLUE, ColorNetwork, RED, image_of};
use dymlm::core::{ColorImage, DepthImage, Detection, Frame, PinholeCamera, Pose};
use dymlm_io::{DetectionFile, TumWriter, read_color_image};

const FRAMES: usize = 8;
const SIZE: [usize; 2] = [256, 192];
/// Side of the squares, pixels: a cell of the network's coarsest grid.
const SIDE: usize = 64;

struct Recorded {
    folder: tempfile::TempDir,
}

impl Recorded {
    /// A wall with a red chair before it and a blue person who goes past; the recording's own detections say that
    /// there is nothing.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let camera = PinholeCamera::new(SIZE[0], SIZE[1], 210.0, 210.0, 127.5, 95.5).unwrap();
        let mut writer = TumWriter::create(folder.path().join("dataset"), &camera).unwrap();
        for index in 0..FRAMES {
            let (color, depth) = images(index);
            let frame = Frame::new(index as f64 * 0.2, camera, depth, Some(color)).unwrap();
            writer.write(&frame, &[], &Pose::identity()).unwrap();
        }
        writer.finish().unwrap();
        let recorded = Self { folder };
        ColorNetwork::new([128, 96], 32).write(&recorded.path("network.onnx"));
        fs::write(recorded.path("names.txt"), "chair\nperson\n").unwrap();
        recorded
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    /// Gives the colour camera a lens with distortion.
    fn distort(&self) {
        let path = self.path("dataset/camera.json");
        let camera = fs::read_to_string(&path).unwrap();
        let lens =
            "\"distortion\": {\"model\": \"brown_conrady\", \"coefficients\": [-0.2, 0.05, 0.0, 0.0, 0.0]}";
        fs::write(&path, camera.trim_end().trim_end_matches('}').to_owned() + ", " + lens + "}").unwrap();
    }

    fn detect(&self, more: &[&str]) -> Output {
        let [dataset, network, names, out] =
            ["dataset", "network.onnx", "names.txt", "found.jsonl"].map(|name| self.text(name));
        let arguments = ["--dataset", &dataset, "--model", &network, "--names", &names, "--out", &out];
        detect(&[&arguments[..], more].concat())
    }

    fn build_map(&self, out: &str, more: &[&str]) -> Output {
        let [dataset, out] = ["dataset", out].map(|name| self.text(name));
        Command::new(env!("CARGO_BIN_EXE_build_map"))
            .args(["--dataset", &dataset, "--out", &out])
            .args(more)
            .output()
            .unwrap()
    }
}

fn detect(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_detect")).args(arguments).output().unwrap()
}

/// The camera's images: every other frame, the person is in another cell of the upper rows.
fn images(index: usize) -> (ColorImage, DepthImage) {
    let (chair, person) = ([SIDE, 2 * SIDE], [index / 2 * SIDE, SIDE]);
    let color = image_of(SIZE, &[(RED, chair, SIDE), (BLUE, person, SIDE)]);
    let depth = color.data().iter().map(|pixel| match *pixel {
        RED => 2.0,
        BLUE => 1.5,
        _ => 3.0,
    });
    let depth = DepthImage::new(SIZE[0], SIZE[1], depth.collect()).unwrap();
    (color, depth)
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn found_in(path: &Path, index: usize) -> Option<Vec<Detection>> {
    let file = DetectionFile::open(path, DetectionFile::DEFAULT_TOLERANCE).unwrap();
    file.at(index as f64 * 0.2).unwrap()
}

#[test]
fn each_frame_has_a_line_of_what_is_in_it() {
    let recorded = Recorded::new();
    // Who has no poses yet may want the detections first.
    fs::remove_file(recorded.path("dataset/groundtruth.txt")).unwrap();
    let (picture, own) = (recorded.text("picture.png"), recorded.text("dataset/detections.jsonl"));
    let output = recorded.detect(&["--picture", &picture, "--compare", &own]);
    assert!(output.status.success(), "{}", stderr(&output));
    for index in 0..FRAMES {
        let found = found_in(&recorded.path("found.jsonl"), index).unwrap();
        let mut boxes: Vec<_> =
            found.iter().map(|one| (one.label(), <[f32; 4]>::from(one.bounding_box()))).collect();
        boxes.sort_by(|a, b| a.0.cmp(b.0));
        let left = (index / 2 * SIDE) as f32;
        let person = [left, 64.0, left + 64.0, 128.0];
        assert_eq!(boxes, [("chair", [64.0, 128.0, 128.0, 192.0]), ("person", person)], "frame {index}");
    }
    let summary = stdout(&output);
    assert!(summary.contains("16 detections in 8 frames") && summary.contains(" ms a frame"), "{summary}");
    assert!(
        summary.contains("8 frames: 16 detections for 0, 16 for 0 of score 0.5 or more; 0 matched"),
        "{summary}"
    );

    // The picture is the middle frame with sides drawn into it.
    let (drawn, plain) = (read_color_image(&picture).unwrap(), images(FRAMES / 2).0);
    let differ = drawn.data().iter().zip(plain.data()).filter(|(one, other)| one != other).count();
    assert_eq!(differ, 2 * (4 * SIDE - 4) * 2 - 2 * 8, "two squares, two pixels wide");
}

#[test]
fn one_image_is_looked_at_alone() {
    let recorded = Recorded::new();
    let (image, picture) = (recorded.path("image.png"), recorded.text("picture.png"));
    let (color, _) = images(0);
    dymlm_io::write_png(&image, SIZE[0], SIZE[1], color.data()).unwrap();
    let [network, names] = ["network.onnx", "names.txt"].map(|name| recorded.text(name));
    let image = image.to_str().unwrap();
    let output = detect(&["--image", image, "--model", &network, "--names", &names, "--picture", &picture]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).contains("chair: 1.000, [64.0, 128.0, 128.0, 192.0]"), "{}", stdout(&output));
    assert!(Path::new(&picture).exists());
}

#[test]
fn a_broken_image_costs_a_warning_and_its_line() {
    let recorded = Recorded::new();
    let image = recorded.path("dataset/rgb/0.200000.png");
    let bytes = fs::read(&image).unwrap();
    fs::write(&image, &bytes[..bytes.len() / 2]).unwrap();
    let output = recorded.detect(&[]);
    assert!(output.status.success() && stderr(&output).contains("frame 1 skipped"), "{}", stderr(&output));
    let found =
        [0, 1, 2].map(|index| found_in(&recorded.path("found.jsonl"), index).map(|found| found.len()));
    assert_eq!(found, [Some(2), None, Some(2)]);
}

#[test]
fn what_fails_leaves_the_older_file() {
    let recorded = Recorded::new();
    let out = recorded.path("found.jsonl");
    fs::write(&out, "older").unwrap();
    let entries = || fs::read_dir(recorded.folder.path()).unwrap().count();
    let before = entries();
    for image in fs::read_dir(recorded.path("dataset/rgb")).unwrap() {
        fs::write(image.unwrap().path(), "no image").unwrap();
    }
    let output = recorded.detect(&[]);
    assert!(
        !output.status.success() && stderr(&output).contains("nothing was detected"),
        "{}",
        stderr(&output)
    );
    assert_eq!((fs::read_to_string(&out).unwrap(), entries()), ("older".to_owned(), before));
}

#[test]
fn a_bag_has_a_line_for_each_frame() {
    let recorded = Recorded::new();
    let bag = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../dymlm-io/tests/bags/plain.mcap");
    let [network, names, out] = ["network.onnx", "names.txt", "bag.jsonl"].map(|name| recorded.text(name));
    let bag = bag.to_str().unwrap();
    let output = detect(&["--dataset", bag, "--model", &network, "--names", &names, "--out", &out]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(!stderr(&output).contains("no detections"), "{}", stderr(&output));
    let file = DetectionFile::open(&out, DetectionFile::DEFAULT_TOLERANCE).unwrap();
    assert!(file.len() > 1 && file.at(100.0).unwrap().is_some());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_what_it_has() {
    let recorded = Recorded::new();
    // Each image is listed many times, so that the run is long enough to be interrupted in any case.
    let list = fs::read_to_string(recorded.path("dataset/associations.txt")).unwrap();
    let line = list.lines().find(|line| !line.starts_with('#')).unwrap();
    let images: Vec<&str> = line.split_whitespace().collect();
    let many = (0..200_000).map(|index| {
        let time = f64::from(index) * 1e-3;
        format!("{time:.3} {} {time:.3} {}\n", images[1], images[3])
    });
    fs::write(recorded.path("dataset/associations.txt"), many.collect::<String>()).unwrap();
    let poses = "0 0 0 0 0 0 0 1\n";
    fs::write(recorded.path("dataset/groundtruth.txt"), poses).unwrap();
    let [dataset, network, names, out] =
        ["dataset", "network.onnx", "names.txt", "found.jsonl"].map(|name| recorded.text(name));
    let run = Command::new(env!("CARGO_BIN_EXE_detect"))
        .args(["--dataset", &dataset, "--model", &network, "--names", &names, "--out", &out])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The output has begun, under another name, before the interruption.
    let has_begun = || {
        let entries = fs::read_dir(recorded.folder.path()).unwrap().flatten();
        entries
            .filter(|entry| entry.file_name().to_string_lossy().starts_with(".dymlm-"))
            .any(|entry| entry.metadata().is_ok_and(|file| file.len() > 0))
    };
    while !has_begun() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    assert!(!Path::new(&out).exists());
    assert!(Command::new("kill").args(["-INT", &run.id().to_string()]).status().unwrap().success());
    let output = run.wait_with_output().unwrap();
    assert!(output.status.success() && stderr(&output).contains("interrupted after"), "{}", stderr(&output));
    let file = DetectionFile::open(&out, DetectionFile::DEFAULT_TOLERANCE).unwrap();
    assert!(file.faults().is_empty() && (1..200_000).contains(&file.len()));
}

/// This holds with a distorting lens too: both programs run on the stored images.
#[test]
fn maps_built_with_the_detector_are_those_of_its_file() {
    for is_distorted in [false, true] {
        let recorded = Recorded::new();
        if is_distorted {
            recorded.distort();
        }
        let [network, names, found] =
            ["network.onnx", "names.txt", "found.jsonl"].map(|name| recorded.text(name));
        assert!(recorded.detect(&[]).status.success());
        let runs: [(&str, &[&str]); 3] = [
            ("by_file", &["--detections", &found]),
            ("by_detector", &["--detector", &network, "--detector-names", &names]),
            ("by_own", &[]),
        ];
        let maps = runs.map(|(out, arguments)| {
            let output = recorded.build_map(out, arguments);
            assert!(output.status.success(), "{}", stderr(&output));
            assert_eq!(
                stdout(&output).contains("\n     detector "),
                out == "by_detector",
                "{}",
                stdout(&output)
            );
            ["cloud.ply", "octree.bt", "planes.json", "objects.json"]
                .map(|file| fs::read(recorded.path(out).join(file)).unwrap())
        });
        assert!(maps[0] == maps[1], "distorted: {is_distorted}");
        assert!(maps[0][0] != maps[2][0] && maps[0][1] != maps[2][1], "detections make a difference");
    }
}

#[test]
fn a_network_that_cannot_be_used_costs_no_run() {
    let recorded = Recorded::new();
    let network = recorded.text("network.onnx");
    let output = recorded.build_map("map", &["--detector", &network]);
    assert!(!output.status.success() && stderr(&output).contains("80 class names"), "{}", stderr(&output));
    assert!(!recorded.path("map").exists());
    let output = recorded.build_map("map", &["--detector", &network, "--detections", "found.jsonl"]);
    assert!(!output.status.success() && stderr(&output).contains("--detections"), "{}", stderr(&output));
}

//! ROS 2 bags in MCAP, made by independent writers (`tests/bags/write_bags.py`).
#![cfg(feature = "mcap")]
use std::fs;
use std::path::{Path, PathBuf};

use dymlm_io::{FrameBuffers, McapOptions, McapRecording, NoTransform, RecordedFrame};

const UNCHUNKED: [&str; 4] =
    ["plain_unchunked", "packed_unchunked", "inverse_unchunked", "odometry_unchunked"];

fn bag(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bags").join(format!("{name}.mcap"))
}

fn open(name: &str) -> McapRecording {
    McapRecording::open(bag(name), &McapOptions::default()).unwrap()
}

fn load_all(recording: &mut McapRecording) -> Vec<RecordedFrame> {
    let mut buffers = FrameBuffers::default();
    (0..recording.frames().len()).map(|index| recording.load(index, &mut buffers).unwrap()).collect()
}

fn warned(recording: &McapRecording, words: &str) -> bool {
    recording.warnings().iter().any(|warning| warning.contains(words))
}

/// The frame of `write_bags.py`: a wall 2 m away, one pixel without a reading; the robot moves at 1 m/s along
/// x.
fn check_frame(loaded: &RecordedFrame, index: usize, color: [u8; 3], tolerance: f32) {
    let frame = &loaded.frame;
    assert!((frame.timestamp() - (100.0 + 0.1 * index as f64)).abs() < 1e-6);
    assert_eq!((frame.camera().width(), frame.camera().height(), frame.camera().fx()), (8, 6, 8.0));
    assert_eq!(frame.depth().at(0, 0), 0.0, "no reading");
    assert!(frame.depth().data()[1..].iter().all(|depth| (depth - 2.0).abs() <= tolerance));
    assert!(frame.color().unwrap().data().iter().all(|pixel| *pixel == color));
    check_pose(loaded, index);
    let found = loaded.detections.as_ref().unwrap();
    assert_eq!((found.len(), found[0].label(), found[0].score()), (1, "person", 0.75));
    assert_eq!(<[f32; 4]>::from(found[0].bounding_box()), [3.0, 1.0, 5.0, 5.0]);
}

/// Poses are interpolated between the transforms, and lead through the camera's mount to the optical frame.
fn check_pose(loaded: &RecordedFrame, index: usize) {
    let centre = loaded.world_from_camera.translation();
    let expected = [0.1 * index as f64, 0.0, 1.0];
    assert!(centre.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{index}: {centre:?}");
    let forward = loaded.world_from_camera.rotate([0.0, 0.0, 1.0]);
    assert!((forward[0] - 1.0).abs() < 1e-12, "{forward:?}");
}

#[test]
fn all_encodings_give_the_same_frames() {
    let color = [200, 100, 50];
    for (name, color, tolerance) in [
        ("plain", color, 0.0),
        ("float", color, 0.0),
        ("rgba", color, 0.0),
        ("bgr", color, 0.0),
        ("packed", color, 0.0),
        ("inverse", [200; 3], 0.05),
        ("plain_zstd", color, 0.0),
        ("plain_lz4", color, 0.0),
        ("plain_unpacked", color, 0.0),
        ("plain_unchunked", color, 0.0),
    ] {
        let mut recording = open(name);
        assert_eq!(recording.warnings(), [""; 0], "{name}");
        let frames = load_all(&mut recording);
        assert_eq!(frames.len(), 4, "{name}");
        for (index, frame) in frames.iter().enumerate() {
            check_frame(frame, index, color, tolerance);
        }
    }
}

#[test]
fn inverse_depth_is_turned_back_within_its_quantization() {
    let mut recording = open("inverse");
    let loaded = recording.load(0, &mut FrameBuffers::default()).unwrap();
    // The stored value is 150 / 2 m - 50 = 25, exactly.
    assert_eq!(loaded.frame.depth().at(1, 0), 2.0);
}

#[test]
fn without_motion_there_is_no_pose() {
    let mut recording = open("no_tf");
    assert!(warned(&recording, "4 of 4 frames have no pose"), "{:?}", recording.warnings());
    assert!(matches!(&recording.frames()[0].world_from_camera, Err(NoTransform::NoMotion { .. })));
    let error = recording.load(0, &mut FrameBuffers::default()).unwrap_err().to_string();
    assert!(error.contains("nothing moves"), "{error}");

    // A camera that does not move has a pose when the world frame is named.
    let mut options = McapOptions::default();
    options.world_frame = Some("base".to_owned());
    let recording = McapRecording::open(bag("no_tf"), &options).unwrap();
    let pose = recording.frames()[3].world_from_camera.clone().unwrap();
    assert_eq!(pose.translation(), [0.0, 0.0, 1.0]);

    options.world_frame = Some("map".to_owned());
    let recording = McapRecording::open(bag("no_tf"), &options).unwrap();
    assert!(matches!(&recording.frames()[0].world_from_camera, Err(NoTransform::NotConnected { .. })));
}

#[test]
fn transforms_that_come_late_count_and_missing_ones_cost_their_frames_alone() {
    let mut recording = open("late_tf");
    assert!(warned(&recording, "1 of 4 frames have no pose"), "{:?}", recording.warnings());
    let mut buffers = FrameBuffers::default();
    assert!(matches!(&recording.frames()[0].world_from_camera, Err(NoTransform::Uncovered { .. })));
    assert!(recording.load(0, &mut buffers).is_err(), "nothing is extrapolated");
    for index in 1..4 {
        check_pose(&recording.load(index, &mut buffers).unwrap(), index);
    }
}

#[test]
fn a_gap_between_transforms_is_not_interpolated_over() {
    let mut options = McapOptions::default();
    options.max_interpolation_gap = 0.05;
    let recording = McapRecording::open(bag("plain"), &options).unwrap();
    assert!(warned(&recording, "4 of 4 frames have no pose"), "{:?}", recording.warnings());
}

#[test]
fn depth_without_colour_near_in_time_is_left_out() {
    let mut recording = open("apart");
    assert!(warned(&recording, "2 of 4 depth images have no colour image"), "{:?}", recording.warnings());
    assert!(warned(&recording, "2 detection arrays"), "{:?}", recording.warnings());
    let frames = load_all(&mut recording);
    assert_eq!(frames.len(), 2);
    check_frame(&frames[1], 2, [200, 100, 50], 0.0);

    let mut options = McapOptions::default();
    options.max_association_gap = 0.001;
    let error = McapRecording::open(bag("plain"), &options).unwrap_err().to_string();
    assert!(error.contains("4 of 4 depth images have no colour image within 0.001 s"), "{error}");
}

#[test]
fn detections_that_nobody_asks_for_are_left_alone() {
    let mut options = McapOptions::default();
    options.without_detections = true;
    for name in ["plain", "apart"] {
        let mut recording = McapRecording::open(bag(name), &options).unwrap();
        assert!(!warned(&recording, "detection"), "{:?}", recording.warnings());
        assert!(load_all(&mut recording).iter().all(|frame| frame.detections.is_none()));
    }
}

#[test]
fn odometry_moves_the_robot_where_tf_does_not() {
    for frame in load_all(&mut open("odometry")).iter().enumerate() {
        check_pose(frame.1, frame.0);
    }
    let mut options = McapOptions::default();
    options.odometry = Some("/odom".to_owned());
    let named = McapRecording::open(bag("odometry"), &options).unwrap();
    assert!(named.frames().iter().all(|frame| frame.world_from_camera.is_ok()));
    options.odometry = Some("/other".to_owned());
    assert!(McapRecording::open(bag("odometry"), &options).is_err());
}

#[test]
fn depth_of_another_camera_is_registered_to_colour() {
    let mut recording = open("two_cameras");
    let loaded = recording.load(0, &mut FrameBuffers::default()).unwrap();
    // 0.25 m at 2 m and fx 8 are one pixel to the right: only the colour camera sees the first column.
    let depth = loaded.frame.depth();
    assert!((0..6).all(|v| depth.at(0, v) == 0.0));
    assert_eq!((depth.at(1, 0), depth.at(2, 0), depth.at(1, 1)), (0.0, 2.0, 2.0));
    check_pose(&loaded, 0);
}

#[test]
fn lenses_are_rectified_with_their_detections() {
    let recorded = [open("fisheye"), open("plain"), open("plumb_bob")]
        .map(|mut recording| recording.load(0, &mut FrameBuffers::default()).unwrap());
    // A wall that faces the camera has the same depth through any lens.
    let [_, plain, distorted] = &recorded;
    assert_eq!(distorted.frame.depth().at(4, 3), plain.frame.depth().at(4, 3));
    check_pose(distorted, 0);
    let boxes = recorded.map(|loaded| loaded.detections.unwrap()[0].bounding_box());
    // A corner at (0.1875, 0.3125) from the axis has radius 0.36443 = t (1 + 0.1 t^2) with t = 0.35981 and
    // tan t = 0.37621: its rectified place is 1.0323 times as far out.
    assert_eq!(boxes[1].y_max(), 5.0);
    assert!((boxes[0].y_max() - 5.0808).abs() < 1e-3, "{boxes:?}");
    // The same corner at 0.36443 = r (1 - 0.1 r^2) with r = 0.36948: 1.01384 times as far out.
    assert!(
        (boxes[2].x_max() - 5.0208).abs() < 1e-3 && (boxes[2].y_max() - 5.0346).abs() < 1e-3,
        "{boxes:?}"
    );
}

#[test]
fn numbered_classes_get_their_names() {
    let mut options = McapOptions::default();
    let label = |options: &McapOptions| {
        let mut recording = McapRecording::open(bag("numbered"), options).unwrap();
        let loaded = recording.load(0, &mut FrameBuffers::default());
        loaded.map(|loaded| loaded.detections.unwrap()[0].label().to_owned())
    };
    assert_eq!(label(&options).unwrap(), "1", "without names an id is the label");
    options.class_names = vec!["person".to_owned(), "chair".to_owned()];
    assert_eq!(label(&options).unwrap(), "chair");
    options.class_names.truncate(1);
    let error = label(&options).unwrap_err().to_string();
    assert!(error.contains("class 1 of 1 names"), "{error}");
}

#[test]
fn a_trajectory_takes_the_place_of_the_bags_poses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    // Poses from the first frame's time to the third's: the fourth frame has none.
    fs::write(&path, "100.0 0 0 5 0 0 0 1\n100.2 0 2 5 0 0 0 1\n").unwrap();
    let mut options = McapOptions::default();
    options.trajectory = Some(path.clone());
    // One bag that says where the robot is, and one that does not.
    for name in ["plain", "no_tf"] {
        let recording = McapRecording::open(bag(name), &options).unwrap();
        let middle = recording.frames()[1].world_from_camera.clone().unwrap().translation();
        assert!((middle[1] - 1.0).abs() < 1e-6 && middle[2] == 5.0, "{name}: {middle:?}");
        assert!(
            matches!(&recording.frames()[3].world_from_camera, Err(NoTransform::Trajectory(_))),
            "{name}"
        );
    }
    fs::write(&path, "100.0 0 0\n").unwrap();
    let error = McapRecording::open(bag("plain"), &options).unwrap_err().to_string();
    assert!(error.contains("poses.txt"), "{error}");
}

#[test]
fn topics_can_be_named() {
    let mut options = McapOptions::default();
    options.depth = Some("/camera/aligned_depth_to_color/image_raw".to_owned());
    options.color = Some("/camera/color/image_raw".to_owned());
    options.color_info = Some("/camera/color/camera_info".to_owned());
    options.detections = Some("/detections".to_owned());
    options.every = 3;
    assert_eq!(McapRecording::open(bag("plain"), &options).unwrap().frames().len(), 2);
    options.depth = Some("/nowhere".to_owned());
    let error = McapRecording::open(bag("plain"), &options).unwrap_err().to_string();
    assert!(error.contains("/nowhere") && error.contains("/camera/color/image_raw (rgb8)"), "{error}");
}

#[test]
fn a_bag_that_breaks_off_is_read_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let whole = fs::read(bag("plain_unpacked")).unwrap();
    let mut counts = Vec::new();
    for end in (0..whole.len()).step_by(509) {
        fs::write(&path, &whole[..end]).unwrap();
        let Ok(mut recording) = McapRecording::open(&path, &McapOptions::default()) else { continue };
        counts.push(recording.frames().len());
        let mut buffers = FrameBuffers::default();
        for index in 0..recording.frames().len() {
            let _ = recording.load(index, &mut buffers);
        }
    }
    assert!(counts.is_sorted() && counts.first() < counts.last(), "{counts:?}");
    assert_eq!(counts.last(), Some(&4));
}

#[test]
fn damaged_bags_are_errors_and_no_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag.mcap");
    let mut state = 1_u64;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    // Chunks have checksums. Messages without chunks have none, so that their damaged content is parsed.
    for name in ["plain", "plain_lz4"].into_iter().chain(UNCHUNKED) {
        let whole = fs::read(bag(name)).unwrap();
        for _ in 0..150 {
            let mut bytes = whole.clone();
            for _ in 0..=next() % 8 {
                let at = next() % bytes.len();
                bytes[at] = [0, 0xff, next() as u8][next() % 3];
            }
            fs::write(&path, &bytes).unwrap();
            let Ok(mut recording) = McapRecording::open(&path, &McapOptions::default()) else { continue };
            let mut buffers = FrameBuffers::default();
            for index in 0..recording.frames().len() {
                let _ = recording.load(index, &mut buffers);
            }
        }
    }
}

#[test]
fn a_file_that_is_no_bag_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no.mcap");
    fs::write(&path, b"no bag").unwrap();
    let error = McapRecording::open(&path, &McapOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no MCAP file"), "{error}");
}

/// A bag whose colours have another encoding, of as many letters; pixels stay as they are.
fn with_encoding(name: &str, [from, to]: [&str; 2], folder: &Path) -> McapRecording {
    let mut bytes = fs::read(bag(name)).unwrap();
    let written = |encoding: &str| {
        let length = (encoding.len() as u32 + 1).to_le_bytes();
        [&length[..], encoding.as_bytes(), &[0]].concat()
    };
    let (from, to) = (written(from), written(to));
    for place in 0..=bytes.len() - from.len() {
        if bytes[place..].starts_with(&from) {
            bytes[place..place + to.len()].copy_from_slice(&to);
        }
    }
    let path = folder.join("bag.mcap");
    fs::write(&path, bytes).unwrap();
    McapRecording::open(&path, &McapOptions::default()).unwrap()
}

/// Regression: such colours vanished without a word.
#[test]
fn colors_of_an_encoding_that_is_not_read_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut recording = with_encoding("plain_unchunked", ["rgb8", "yuyv"], folder.path());
    assert!(warned(&recording, "no colours: ") && warned(&recording, "(yuyv)"), "{:?}", recording.warnings());
    assert!(load_all(&mut recording).iter().all(|loaded| loaded.frame.color().is_none()));
}

/// `cv_bridge` passes on a `cv::Mat` of colours as 8UC3, blue first.
#[test]
fn colors_of_opencv_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let mut recording = with_encoding("plain_unchunked", ["rgb8", "8UC3"], folder.path());
    assert_eq!(recording.warnings(), [""; 0]);
    let frames = load_all(&mut recording);
    frames.iter().enumerate().for_each(|(index, loaded)| check_frame(loaded, index, [50, 100, 200], 0.0));
}

//! Sessions in MCAP: what is written is read back, by the reader of bags. What readers in Python make of it
//! is in `tests/viewers`.
#![cfg(feature = "mcap")]
use std::fs;
use std::path::Path;

use dymlm_core::{
    BoundingBox, ColorImage, DepthImage, Detection, Frame, PinholeCamera, PointCloud, Pose, Rgb,
};
use dymlm_io::{
    ColorEncoding, DepthEncoding, Error, FrameBuffers, GridRecord, McapOptions, McapRecording, McapWriter,
    McapWriterOptions, ObjectRecord, PlaneRecord, RecordedFrame, ShapeRecord,
};
use proptest::prelude::*;

const SIZE: [usize; 2] = [40, 30];

fn camera() -> PinholeCamera {
    PinholeCamera::new(SIZE[0], SIZE[1], 33.1, 33.7, 19.3, 14.9).unwrap()
}

fn pose(index: usize) -> Pose {
    let (sin, cos) = (0.01 * index as f64).sin_cos();
    Pose::new([0.1 * index as f64, -0.3, 1.0 / 3.0], [0.0, sin, 0.0, cos]).unwrap()
}

/// No two are alike, and no depth is a whole number of millimetres.
fn frame(index: usize) -> Frame {
    let pixels = SIZE[0] * SIZE[1];
    let metres =
        |pixel: usize| if pixel.is_multiple_of(7) { 0.0 } else { 1.0 + (pixel + index) as f32 / 997.0 };
    let depth = DepthImage::new(SIZE[0], SIZE[1], (0..pixels).map(metres).collect()).unwrap();
    let shade = |pixel: usize| -> Rgb { [(pixel / SIZE[0] * 8) as u8, (index * 20) as u8, 99] };
    let color = ColorImage::new(SIZE[0], SIZE[1], (0..pixels).map(shade).collect()).unwrap();
    // From 0 on, where a time stamp says nothing.
    Frame::new(0.1 * index as f64, camera(), depth, Some(color)).unwrap()
}

/// What a detector says: at times nothing, at times that nothing is there.
fn detections(index: usize) -> Option<Vec<Detection>> {
    let found = |x: f32| {
        Detection::new("dining table", 0.7 + 0.01 * x, BoundingBox::new(x, 2.25, x + 7.3, 20.1).unwrap())
            .unwrap()
    };
    match index % 3 {
        0 => None,
        1 => Some(Vec::new()),
        _ => Some(vec![found(1.1), found(5.0)]),
    }
}

fn write(path: &Path, options: &McapWriterOptions, frames: usize) {
    let mut writer = McapWriter::create(path, options).unwrap();
    for index in 0..frames {
        writer.write_frame(&frame(index), detections(index).as_deref(), &pose(index)).unwrap();
    }
    writer.finish().unwrap();
}

fn read(path: &Path) -> Vec<RecordedFrame> {
    let mut recording = McapRecording::open(path, &McapOptions::default()).unwrap();
    assert!(
        recording.warnings().iter().all(|warning| warning.contains("no detections")),
        "{:?}",
        recording.warnings()
    );
    let mut buffers = FrameBuffers::default();
    (0..recording.frames().len()).map(|index| recording.load(index, &mut buffers).unwrap()).collect()
}

fn options(depth: DepthEncoding, color: ColorEncoding) -> McapWriterOptions {
    let mut options = McapWriterOptions::default();
    (options.depth, options.color) = (depth, color);
    options
}

#[test]
fn exact_frames_come_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    write(&path, &McapWriterOptions::exact(), 12);
    let loaded = read(&path);
    assert_eq!(loaded.len(), 12);
    for (index, loaded) in loaded.iter().enumerate() {
        let written = frame(index);
        assert!((loaded.frame.timestamp() - written.timestamp()).abs() < 1e-9);
        assert_eq!(loaded.frame.camera(), written.camera());
        assert!(loaded.frame.depth() == written.depth() && loaded.frame.color() == written.color());
        assert_eq!(loaded.detections, detections(index), "{index}");
        assert!(loaded.world_from_camera.distance(&pose(index)) < 1e-12);
        assert!(loaded.world_from_camera.angle(&pose(index)) < 1e-7);
    }
}

#[test]
fn viewers_pictures_are_near_enough() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    for depth in [DepthEncoding::Millimetres, DepthEncoding::MillimetresPng] {
        write(&path, &options(depth, ColorEncoding::Jpeg), 4);
        for (index, loaded) in read(&path).iter().enumerate() {
            let written = frame(index);
            for (a, b) in loaded.frame.depth().data().iter().zip(written.depth().data()) {
                assert!((a - b).abs() < 0.000_501 && (*a == 0.0) == (*b == 0.0), "{a} {b}");
            }
            let colors = loaded.frame.color().unwrap().data().iter().zip(written.color().unwrap().data());
            let off: f64 = colors.map(|(a, b)| f64::from(a[0].abs_diff(b[0]))).sum();
            assert!(off / (SIZE[0] * SIZE[1]) as f64 <= 3.0, "{off}");
        }
    }
    // What is too far for 16 bits is no reading, and not something near.
    let depth = DepthImage::new(SIZE[0], SIZE[1], vec![65.536; SIZE[0] * SIZE[1]]).unwrap();
    let mut writer =
        McapWriter::create(&path, &options(DepthEncoding::Millimetres, ColorEncoding::None)).unwrap();
    for time in [1.0, 2.0] {
        let far = Frame::new(time, camera(), depth.clone(), None).unwrap();
        writer.write_frame(&far, None, &Pose::identity()).unwrap();
    }
    writer.finish().unwrap();
    assert!(read(&path).iter().all(|loaded| loaded.frame.depth().data().iter().all(|&d| d == 0.0)));
}

#[test]
fn what_is_left_out_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    write(&path, &options(DepthEncoding::Exact, ColorEncoding::None), 3);
    assert!(read(&path).iter().all(|loaded| loaded.frame.color().is_none()));
    write(&path, &options(DepthEncoding::None, ColorEncoding::Jpeg), 3);
    let error = McapRecording::open(&path, &McapOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no depth images"), "{error}");
    // Without a message it is a file, too.
    write(&path, &McapWriterOptions::default(), 0);
    let error = McapRecording::open(&path, &McapOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no depth images") && !error.contains("breaks off"), "{error}");
}

#[test]
fn a_crash_costs_no_more_than_what_was_not_flushed() {
    let folder = tempfile::tempdir().unwrap();
    let (path, cut_path) = (folder.path().join("session.mcap"), folder.path().join("cut.mcap"));
    let mut writer = McapWriter::create(&path, &McapWriterOptions::exact()).unwrap();
    // How long the file is once so many frames are safe.
    let mut safe = Vec::new();
    for index in 0..6 {
        writer.write_frame(&frame(index), None, &pose(index)).unwrap();
        writer.flush().unwrap();
        safe.push(fs::metadata(&path).unwrap().len() as usize);
    }
    // Nobody finishes it.
    std::mem::forget(writer);
    let whole = fs::read(&path).unwrap();
    assert_eq!(whole.len(), safe[5]);
    for cut in (8..=whole.len()).step_by(61).chain(safe.iter().copied()) {
        fs::write(&cut_path, &whole[..cut]).unwrap();
        let expected = safe.iter().filter(|length| **length <= cut).count();
        match McapRecording::open(&cut_path, &McapOptions::default()) {
            Ok(mut recording) => {
                let warning = recording.warnings().iter().any(|warning| warning.contains("breaks off"));
                assert!(warning, "{cut}: {:?}", recording.warnings());
                assert!(recording.frames().len() >= expected, "{cut}");
                for index in 0..expected {
                    let loaded = recording.load(index, &mut FrameBuffers::default()).unwrap();
                    assert!(loaded.frame.depth() == frame(index).depth(), "{cut}");
                }
            }
            Err(error) => assert!(expected == 0, "{cut}: {error}"),
        }
    }
}

#[test]
fn a_dropped_writer_leaves_a_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let mut writer = McapWriter::create(&path, &McapWriterOptions::exact()).unwrap();
    writer.write_frame(&frame(0), Some(&[]), &pose(0)).unwrap();
    writer.write_frame(&frame(1), Some(&[]), &pose(1)).unwrap();
    drop(writer);
    assert_eq!(read(&path).len(), 2);
    assert_eq!(
        fs::read(&path).unwrap()[fs::metadata(&path).unwrap().len() as usize - 8..],
        *b"\x89MCAP0\r\n"
    );
}

#[test]
fn what_the_file_cannot_hold_is_refused_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.mcap");
    let mut bad = McapWriterOptions::default();
    bad.jpeg_quality = 0;
    assert!(matches!(McapWriter::create(&path, &bad), Err(Error::Config(_))));
    assert!(!path.exists());
    let missing = folder.path().join("none/session.mcap");
    assert!(matches!(McapWriter::create(missing, &McapWriterOptions::default()), Err(Error::Io { .. })));

    let mut writer = McapWriter::create(&path, &McapWriterOptions::exact()).unwrap();
    let cloud = PointCloud::new(vec![[1.0; 3]]);
    for time in [-0.1, f64::NAN, f64::INFINITY, 2.2e9] {
        let error = writer.write_cloud("/map/cloud", time, &cloud).unwrap_err();
        assert!(matches!(&error, Error::Unwritable { .. }), "{error}");
        assert!(error.to_string().contains("the time"), "{error}");
    }
    let grid = |width: usize, height: usize| GridRecord {
        width,
        height,
        resolution: 0.05,
        world_from_grid: Pose::identity(),
        cells: vec![0; 6],
    };
    for (width, height) in [(2, 2), (usize::MAX, 2), (1 << 33, 0)] {
        assert!(matches!(writer.write_grid(1.0, &grid(width, height)), Err(Error::Unwritable { .. })));
    }
    writer.write_grid(1.0, &grid(3, 2)).unwrap();
    writer.write_frame(&frame(1), None, &pose(1)).unwrap();
    writer.write_frame(&frame(2), None, &pose(2)).unwrap();
    writer.finish().unwrap();
    assert_eq!(read(&path).len(), 2);
}

#[test]
fn things_that_are_none_are_written_without_a_shape() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer =
        McapWriter::create(folder.path().join("session.mcap"), &McapWriterOptions::default()).unwrap();
    let plane = PlaneRecord {
        id: u64::MAX,
        normal: [f64::NAN; 3],
        d: f64::INFINITY,
        centroid: [0.0; 3],
        area_m2: f64::NAN,
        observations: 0,
        inliers: 0,
        boundary: vec![Vec::new(), vec![[f64::NAN; 3]; 4]],
    };
    let object = ObjectRecord {
        id: 0,
        label: "\0 \u{1f600}".into(),
        score: f64::NAN,
        shape: ShapeRecord::Ellipsoid,
        rotation: [0.0; 4],
        translation: [f64::NAN; 3],
        dimensions: [-1.0; 3],
        observations: 0,
        points: 0,
    };
    writer.write_planes(0.0, &[plane], &[3, 3]).unwrap();
    writer.write_objects(0.0, &[object], &[], [0.0; 3]).unwrap();
    writer.write_cloud("", 0.0, &PointCloud::default()).unwrap();
    writer.finish().unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Times of real recordings, whose last bit is more than a nanosecond, come back to the bit.
    #[test]
    fn times_come_back(seconds in 1_000_000_000.0_f64..2_000_000_000.0, step in 0.01_f64..1.0) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("session.mcap");
        let mut writer = McapWriter::create(&path, &options(DepthEncoding::Exact, ColorEncoding::None)).unwrap();
        let times = [seconds, seconds + step];
        for time in times {
            let depth = DepthImage::new(SIZE[0], SIZE[1], vec![1.0; SIZE[0] * SIZE[1]]).unwrap();
            let frame = Frame::new(time, camera(), depth, None).unwrap();
            writer.write_frame(&frame, None, &Pose::identity()).unwrap();
        }
        writer.finish().unwrap();
        let loaded = read(&path);
        prop_assert_eq!(loaded.iter().map(|one| one.frame.timestamp()).collect::<Vec<_>>(), times);
    }
}

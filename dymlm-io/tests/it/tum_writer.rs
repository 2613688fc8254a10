//! What is written as a dataset is read back as it was.
use dymlm_core::{BoundingBox, ColorImage, DepthImage, Detection, Frame, PinholeCamera, Pose};
use dymlm_io::{DetectionFile, Error, FrameBuffers, TumDataset, TumOptions, TumRecording, TumWriter};

fn camera() -> PinholeCamera {
    PinholeCamera::new(6, 4, 5.25, 5.5, 2.5, 1.75).unwrap()
}

/// Depth in whole steps of the file's scale, with some pixels without a reading.
fn frame(index: usize) -> Frame {
    let depth = (0..24)
        .map(|i| if (i + index).is_multiple_of(5) { 0.0 } else { (5000 + 7 * i + index) as f32 / 5000.0 });
    let color = (0..24).map(|i| [i as u8, index as u8, 200]).collect();
    let depth = DepthImage::new(6, 4, depth.collect()).unwrap();
    let color = ColorImage::new(6, 4, color).unwrap();
    Frame::new(index as f64 / 30.0, camera(), depth, Some(color)).unwrap()
}

fn pose(index: usize) -> Pose {
    let half = 0.1 * index as f64;
    Pose::new([0.1, -0.7, index as f64 / 3.0], [0.0, half.sin(), 0.0, half.cos()]).unwrap()
}

fn detections(index: usize) -> Vec<Detection> {
    let area = BoundingBox::new(0.25, 1.0, 4.5, 4.0).unwrap();
    (0..index % 3).map(|_| Detection::new("person", 0.75, area).unwrap()).collect()
}

#[test]
fn a_written_sequence_is_read_back_as_it_was() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("new/sequence");
    let mut writer = TumWriter::create(&folder, &camera()).unwrap();
    for index in 0..7 {
        writer.write(&frame(index), &detections(index), &pose(index)).unwrap();
    }
    assert!(TumDataset::open(&folder, &TumOptions::default()).is_err(), "not finished");
    writer.finish().unwrap();

    let dataset = TumDataset::open(&folder, &TumOptions::default()).unwrap();
    assert!(dataset.faults().is_empty() && dataset.unpaired_depth_images() == 0);
    assert_eq!(dataset.frames().len(), 7);
    let found =
        DetectionFile::open(folder.join("detections.jsonl"), DetectionFile::DEFAULT_TOLERANCE).unwrap();
    for index in 0..7 {
        let posed = dataset.load(index).unwrap();
        let written = frame(index);
        assert_eq!(posed.frame.camera(), written.camera());
        assert_eq!(posed.frame.color(), written.color());
        assert!((posed.frame.timestamp() - written.timestamp()).abs() < 1e-6);
        for (read, written) in posed.frame.depth().data().iter().zip(written.depth().data()) {
            assert!((read - written).abs() < 1e-6);
        }
        assert!(posed.world_from_camera.distance(&pose(index)) < 1e-12);
        assert!(posed.world_from_camera.angle(&pose(index)) < 1e-7);
        assert_eq!(found.at(written.timestamp()).unwrap(), Some(detections(index)));
    }
}

#[test]
fn refuses_what_is_in_the_way_and_what_does_not_belong() {
    let parent = tempfile::tempdir().unwrap();
    std::fs::write(parent.path().join("notes.txt"), "mine").unwrap();
    assert!(matches!(TumWriter::create(parent.path(), &camera()), Err(Error::InTheWay { .. })));
    assert_eq!(std::fs::read_dir(parent.path()).unwrap().count(), 1, "nothing was added");

    let folder = parent.path().join("sequence");
    let mut writer = TumWriter::create(&folder, &camera()).unwrap();
    writer.write(&frame(3), &[], &pose(3)).unwrap();
    let error = writer.write(&frame(3), &[], &pose(3)).unwrap_err();
    assert!(error.to_string().contains("a frame of 0.1 s after one of 0.1 s"), "{error}");
    let other = PinholeCamera::new(6, 4, 5.0, 5.5, 2.5, 1.75).unwrap();
    let foreign = Frame::new(9.0, other, DepthImage::new(6, 4, vec![1.0; 24]).unwrap(), None).unwrap();
    assert!(writer.write(&foreign, &[], &pose(4)).unwrap_err().to_string().contains("another camera"));
    writer.finish().unwrap();
    assert_eq!(TumDataset::open(&folder, &TumOptions::default()).unwrap().frames().len(), 1);
}

/// A frame of one depth, taken at any time.
fn flat_frame(timestamp: f64, depth: f32, color: Option<ColorImage>) -> Frame {
    Frame::new(timestamp, camera(), DepthImage::new(6, 4, vec![depth; 24]).unwrap(), color).unwrap()
}

#[test]
fn no_two_frames_share_a_file() {
    let parent = tempfile::tempdir().unwrap();
    // Unix times: neighbouring numbers are 2.4e-7 s apart. The second and the third have one name, and so have
    // the last two, but for the sign.
    let times = [1_305_031_102.901_420_6, 1_305_031_102.901_427_5, 1_305_031_102.901_428_5, 1_305_031_103.0];
    for (number, times, accepted) in
        [(0, &times[..], [0, 1, 3].as_slice()), (1, &[-4e-7, 4e-7], &[0]), (2, &[4.9e-7, 5.1e-7], &[0, 1])]
    {
        let folder = parent.path().join(number.to_string());
        let mut writer = TumWriter::create(&folder, &camera()).unwrap();
        for (index, &time) in times.iter().enumerate() {
            let written = writer.write(&flat_frame(time, 1.0 + index as f32, None), &[], &pose(index));
            assert_eq!(written.is_ok(), accepted.contains(&index), "{time} s: {written:?}");
            if let Err(error) = written {
                let [frame, last] = [index, index - 1].map(|index| times[index].to_string());
                assert!(error.to_string().contains(&frame) && error.to_string().contains(&last), "{error}");
            }
        }
        writer.finish().unwrap();
        let dataset = TumDataset::open(&folder, &TumOptions::default()).unwrap();
        assert_eq!(dataset.frames().len(), accepted.len());
        for (place, &index) in accepted.iter().enumerate() {
            let posed = dataset.load(place).unwrap();
            assert!((posed.frame.depth().data()[0] - (1.0 + index as f32)).abs() < 1e-6);
            assert!(posed.world_from_camera.distance(&pose(index)) < 1e-12);
        }
    }
}

#[test]
fn all_frames_have_colour_or_none() {
    let parent = tempfile::tempdir().unwrap();
    let color = || ColorImage::new(6, 4, vec![[9, 8, 7]; 24]).unwrap();
    for is_colored in [true, false] {
        let folder = parent.path().join(is_colored.to_string());
        let mut writer = TumWriter::create(&folder, &camera()).unwrap();
        let frame = |time: f64, colored: bool| flat_frame(time, 2.0, colored.then(color));
        writer.write(&frame(0.0, is_colored), &[], &pose(0)).unwrap();
        let error = writer.write(&frame(0.1, !is_colored), &[], &pose(1)).unwrap_err().to_string();
        let expected = if is_colored { "0.1 s has no colour" } else { "0.1 s has colour" };
        assert!(error.contains(expected), "{error}");
        writer.write(&frame(0.2, is_colored), &[], &pose(2)).unwrap();
        writer.finish().unwrap();

        let files = |images: &str| std::fs::read_dir(folder.join(images)).unwrap().count();
        assert_eq!([files("depth"), files("rgb")], [2, if is_colored { 2 } else { 0 }]);
        let dataset = TumDataset::open(&folder, &TumOptions::default()).unwrap();
        let times: Vec<f64> = dataset.frames().iter().map(|frame| frame.timestamp).collect();
        assert_eq!((times.as_slice(), dataset.warnings().len()), ([0.0, 0.2].as_slice(), 0));
        assert!((0..2).all(|index| dataset.load(index).unwrap().frame.color().is_some() == is_colored));
    }
}

#[test]
fn detections_that_nobody_asks_for_are_left_alone() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("sequence");
    let mut writer = TumWriter::create(&folder, &camera()).unwrap();
    for index in 0..3 {
        writer.write(&frame(index), &detections(index), &pose(index)).unwrap();
    }
    writer.finish().unwrap();
    // A file that would be an error for its frames.
    std::fs::write(folder.join("detections.jsonl"), "broken\n").unwrap();
    let options = TumOptions::default();
    let mut buffers = FrameBuffers::default();
    let own = TumRecording::open(&folder, None, &options).unwrap();
    assert!(own.load(1, &mut buffers).is_err() && own.warnings().len() == 1);

    let alone = TumRecording::without_detections(&folder, &options).unwrap();
    assert!(alone.warnings().is_empty());
    for index in 0..3 {
        let loaded = alone.load(index, &mut buffers).unwrap();
        assert_eq!((loaded.frame.color(), loaded.detections), (frame(index).color(), None));
    }
}

/// Frames at 60 Hz, 17 ms apart, and a detector on every second one: its lines are within the tolerance of the
/// frames between, on which it has not run.
#[test]
fn each_line_of_detections_is_one_frame_s() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("fast");
    let time = |index: usize| index as f64 / 60.0;
    let mut writer = TumWriter::create(&folder, &camera()).unwrap();
    for index in 0..8 {
        writer.write(&flat_frame(time(index), 1.0, None), &[], &pose(0)).unwrap();
    }
    writer.finish().unwrap();
    // Lines are a bit late; one time occurs twice, and one line is damaged.
    let line = |time: f64, label: &str| {
        let found = format!(r#"{{"label": "{label}", "score": 0.75, "bbox": [0.25, 1, 4.5, 4]}}"#);
        format!("{{\"timestamp\": {time:.6}, \"detections\": [{found}]}}\n")
    };
    let late = |index: usize| time(index) + 0.004;
    let lines = [
        line(late(0), "0"),
        line(late(2), "2"),
        line(late(2), "again"),
        format!("{{\"timestamp\": {:.6}, \"detect\n", late(4)),
        line(late(6), "6"),
    ];
    std::fs::write(folder.join("detections.jsonl"), lines.concat()).unwrap();

    let mut buffers = FrameBuffers::default();
    let mut found = |every: usize| {
        let mut options = TumOptions::default();
        options.every = every;
        let recording = TumRecording::open(&folder, None, &options).unwrap();
        let frames = 0..recording.dataset().frames().len();
        let label = |index: usize| match recording.load(index, &mut buffers) {
            Ok(loaded) => loaded.detections.map_or("none".to_owned(), |found| found[0].label().to_owned()),
            Err(error) => {
                assert!(error.to_string().contains("detections.jsonl, line 4"), "{error}");
                "damaged".to_owned()
            }
        };
        frames.map(label).collect::<Vec<_>>()
    };
    assert_eq!(found(1), ["0", "none", "2", "none", "damaged", "none", "6", "none"]);
    // The detections of a frame that is left out are no other's.
    assert_eq!(found(3), ["0", "none", "6"]);
}

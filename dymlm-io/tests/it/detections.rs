//! Detections: JSON lines and YOLO folders, good and bad.
use std::fs;
use std::path::PathBuf;

use dymlm_core::{BoundingBox, Detection, Mask};
use dymlm_io::{DetectionFile, Error, YoloFolder, encode_detections, read_class_names, write_detections};
use proptest::prelude::*;
use tempfile::TempDir;

fn file(content: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("detections.jsonl");
    fs::write(&path, content).unwrap();
    (folder, path)
}

fn open(content: impl AsRef<[u8]>) -> DetectionFile {
    let (_folder, path) = file(content);
    DetectionFile::open(path, 0.02).unwrap()
}

#[test]
fn finds_the_nearest_line_within_the_tolerance() {
    let detections = open(
        r#"# labels tell the lines apart
{"timestamp": 0.10, "detections": [{"label": "b", "score": 1, "bbox": [0, 0, 1, 1]}], "model": "x"}
{"timestamp": 0.00, "detections": [{"label": "a", "score": 0.5, "bbox": [0, 0, 1, 1], "id": 3}]}

{"timestamp": 0.13, "detections": []}
"#,
    );
    let label =
        |t: f64| detections.at(t).unwrap().map(|found| found.first().map(|one| one.label().to_owned()));
    assert_eq!(label(0.0), Some(Some("a".to_owned())));
    assert_eq!(label(-0.019), Some(Some("a".to_owned())));
    assert_eq!(label(0.05), None);
    assert_eq!(label(0.11), Some(Some("b".to_owned())));
    assert_eq!(label(0.12), Some(None), "nothing was found");
    assert_eq!(label(0.16), None);
    assert_eq!(label(f64::NAN), None);
    assert_eq!(detections.len(), 3);
    assert!(detections.faults().is_empty());
    assert!(open("").is_empty());
}

#[test]
fn of_two_lines_with_one_time_the_first_is_found() {
    let line = |label: &str| {
        format!(
            r#"{{"timestamp": 0.1, "detections": [{{"label": "{label}", "score": 1, "bbox": [0, 0, 1, 1]}}]}}"#
        )
    };
    let detections = open([line("first"), line("second"), line("third")].join("\n"));
    for timestamp in [0.099, 0.1, 0.1_f64.next_up(), 0.101] {
        assert_eq!(detections.at(timestamp).unwrap().unwrap()[0].label(), "first", "{timestamp}");
    }
}

#[test]
fn a_bad_line_is_an_error_for_its_frame_alone() {
    let good = |t: f64| format!("{{\"timestamp\": {t}, \"detections\": []}}");
    for (bad, said) in [
        (r#"{"timestamp": 1.0, "detections": [{"label": "person", "sc"#, "EOF"),
        (
            r#"{"timestamp": 1.0, "detections": [{"label": "person", "score": 1.5, "bbox": [0, 0, 1, 1]}]}"#,
            "1.5",
        ),
        (
            r#"{"timestamp": 1.0, "detections": [{"label": "person", "score": 0.5, "bbox": [5, 0, 1, 1]}]}"#,
            "no box",
        ),
        (
            r#"{"timestamp": 1.0, "detections": [{"label": "person", "score": 0.5, "bbox": [0, 0, 1]}]}"#,
            "length 3",
        ),
        (r#"{"timestamp": 1.0, "detections": [{"label": "person", "bbox": [0, 0, 1, 1]}]}"#, "score"),
        (
            r#"{"timestamp": 1.0, "detections": [{"label": "person", "score": null, "bbox": [0, 0, 1, 1]}]}"#,
            "null",
        ),
        (r#"{"timestamp": 1.0}"#, "detections"),
        // Lines without a time of their own: they must be for a frame between their neighbours.
        (r#"{"timestamp": 1."#, "EOF"),
        (r#"{"timestamp": "noon", "detections": []}"#, "noon"),
        (r#"{"detections": []}"#, "timestamp"),
        ("[1, 2]", "invalid type"),
        ("person 3 4 5", "expected value"),
        (r#"{"timestamp": 1e999, "detections": []}"#, "number out of range"),
    ] {
        let detections = open([good(0.0), bad.to_owned(), good(2.0)].join("\n"));
        for t in [0.0, 2.0] {
            assert_eq!(detections.at(t).unwrap(), Some(Vec::new()), "{bad}");
        }
        let error = detections.at(1.0).expect_err(bad);
        assert!(matches!(error, Error::Line { line: 2, .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains("detections.jsonl, line 2") && message.contains(said), "{message}");
        assert!(!message.contains("line 1"), "{message}");
        assert_eq!(detections.at(3.0).unwrap(), None);
        assert_eq!(detections.faults().len(), 1);
    }
    let not_utf8 = open([good(0.0).as_bytes(), b"\n\xff{}\n", good(2.0).as_bytes()].concat());
    assert!(matches!(not_utf8.at(1.0), Err(Error::Line { line: 2, .. })));
    assert!(not_utf8.at(0.0).is_ok());
}

#[test]
fn a_missing_file_and_a_bad_tolerance_are_errors() {
    let (folder, path) = file("");
    assert!(matches!(DetectionFile::open(folder.path().join("none"), 0.02), Err(Error::Io { .. })));
    assert!(matches!(DetectionFile::open(path, f64::NAN), Err(Error::Config(_))));
}

#[test]
fn times_that_are_none_are_not_written() {
    let (_folder, path) = file("old");
    assert!(matches!(write_detections(&path, [(f64::NAN, &[][..])]), Err(Error::Content { .. })));
    assert_eq!(fs::read_to_string(&path).unwrap(), "old", "a failed call changes nothing");
}

#[test]
fn writes_a_file() {
    let (_folder, path) = file("old");
    let found =
        [Detection::new("dining table", 0.25, BoundingBox::new(-1.5, 0.0, 3.0, 4.0).unwrap()).unwrap()];
    write_detections(&path, [(0.166_667, &found[..]), (0.5, &[])]).unwrap();
    assert_eq!(
        fs::read_to_string(&path).unwrap(),
        "{\"timestamp\":0.166667,\"detections\":[{\"label\":\"dining table\",\"score\":0.25,\
         \"bbox\":[-1.5,0.0,3.0,4.0]}]}\n{\"timestamp\":0.5,\"detections\":[]}\n"
    );
}

/// The mask of dymlm-core's tests, encoded by `pycocotools.mask.encode`: (u u + 3 v) % 5 < 2, 7x5 pixels.
#[test]
fn masks_are_read_and_written_as_cocos_run_lengths() {
    let line = "{\"timestamp\":0.5,\"detections\":[{\"label\":\"cup\",\"score\":0.5,\"bbox\":[0.0,0.0,7.0,5.0],\
                \"mask\":{\"size\":[5,7],\"counts\":\"0110100010N010O11OO0001000O\"}}]}\n";
    let found = open(line).at(0.5).unwrap().unwrap();
    let expected = Mask::from_fn(7, 5, |u, v| (u * u + 3 * v) % 5 < 2).unwrap();
    assert_eq!(found[0].mask(), Some(&expected));
    let mut written = Vec::new();
    encode_detections(&mut written, 0.5, &found).unwrap();
    assert_eq!(String::from_utf8(written).unwrap(), line);

    let list = line.replace("\"0110100010N010O11OO0001000O\"", &format!("{:?}", expected.run_lengths()));
    assert_eq!(open(list).at(0.5).unwrap().unwrap(), found);
    let short = open(line.replace("[5,7]", "[5,8]"));
    assert!(short.at(0.5).unwrap_err().to_string().contains("line 1: run-lengths that add up to 35"));

    // Each row of a mask begins with a word of its own: these take 512 MiB each.
    let mask = "\"mask\":{\"size\":[67108864,1],\"counts\":[67108864]}";
    let tall = format!("{{\"label\":\"cup\",\"score\":0.5,\"bbox\":[0,0,7,5],{mask}}}");
    let line = |detections: &str| format!("{{\"timestamp\":0.5,\"detections\":[{detections}]}}");
    assert!(open(line(&tall)).faults().is_empty());
    let twice = line(&format!("{tall},{tall}"));
    let reason = open(twice).at(0.5).unwrap_err().to_string();
    assert!(reason.contains("line 1: masks of 1073741824 bytes together"), "{reason}");
}

#[test]
fn reads_yolo_folders() {
    let folder = tempfile::tempdir().unwrap();
    let names_path = folder.path().join("names");
    fs::write(&names_path, "person\r\ndining table\n\n").unwrap();
    let names = read_class_names(&names_path).unwrap();
    assert_eq!(names, ["person", "dining table"]);
    fs::write(folder.path().join("frame 1.txt"), "1 0.5 0.25 0.5 0.5\n\n0 0.1 0.5 0.2 1.0 0.75\n").unwrap();
    let yolo = YoloFolder::open(folder.path(), names.clone(), 200, 100).unwrap();
    let found = yolo.read("anywhere/frame 1.jpg").unwrap();
    let expected = [
        Detection::new("dining table", 1.0, BoundingBox::new(50.0, 0.0, 150.0, 50.0).unwrap()).unwrap(),
        Detection::new("person", 0.75, BoundingBox::new(0.0, 0.0, 40.0, 100.0).unwrap()).unwrap(),
    ];
    assert_eq!(found, expected);
    assert!(yolo.read("frame 2.jpg").unwrap().is_empty());
    assert!(matches!(YoloFolder::open(folder.path().join("none"), names, 2, 1), Err(Error::Io { .. })));

    for (bad, said) in [
        ("2 0.5 0.5 0.1 0.1", "class \"2\" of 2 names"),
        ("-1 0.5 0.5 0.1 0.1", "class"),
        ("person 0.5 0.5 0.1 0.1", "class"),
        ("0 0.5 0.5 0.1", "4 columns"),
        ("0 0.5 0.5 0.1 0.1 0.9 7", "7 columns"),
        ("0 320 240 64 48 0.9", "not in parts"),
        ("0 0.5 0.5 -0.1 0.1", "not in parts"),
        ("0 0.5 nan 0.1 0.1", "no finite number"),
        ("0 0.5 0.5 0.1 0.1 1.5", "score"),
    ] {
        fs::write(folder.path().join("bad.txt"), format!("0 0.5 0.5 0.1 0.1\n{bad}\n")).unwrap();
        let error = yolo.read("bad.png").unwrap_err();
        assert!(matches!(error, Error::Line { line: 2, .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains("bad.txt, line 2") && message.contains(said), "{message}");
    }
}

#[test]
fn yolo_folders_of_images_without_pixels_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (width, height) in [(0, 480), (640, 0)] {
        let refused = YoloFolder::open(folder.path(), Vec::new(), width, height);
        assert!(matches!(refused, Err(Error::Config(_))), "{width}x{height}");
    }
}

#[test]
fn a_byte_order_mark_is_no_part_of_a_class_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("coco.names");
    fs::write(&path, "\u{feff}person\nbicycle\n").unwrap();
    assert_eq!(read_class_names(&path).unwrap(), ["person", "bicycle"]);
}

fn any_detection() -> impl Strategy<Value = Detection> {
    (".{0,12}", 0.0..=1.0_f32, prop::array::uniform4(-1e4..1e4_f32)).prop_map(
        |(label, score, [a, b, c, d])| {
            let bounding_box = BoundingBox::new(a.min(c), b.min(d), a.max(c), b.max(d)).unwrap();
            Detection::new(label, score, bounding_box).unwrap()
        },
    )
}

proptest! {
    #[test]
    fn reads_what_it_wrote(
        frames in prop::collection::vec((0.0..2e9_f64, prop::collection::vec(any_detection(), 0..5)), 0..20),
    ) {
        let mut frames = frames;
        frames.sort_by(|a, b| a.0.total_cmp(&b.0));
        frames.dedup_by(|a, b| a.0 == b.0);
        let mut bytes = Vec::new();
        for (t, found) in &frames {
            encode_detections(&mut bytes, *t, found).unwrap();
        }
        let (_folder, path) = file(bytes);
        let read = DetectionFile::open(&path, 0.0).unwrap();
        prop_assert!(read.faults().is_empty());
        for (t, found) in &frames {
            prop_assert_eq!(&read.at(*t).unwrap().unwrap(), found);
        }
    }

    #[test]
    fn every_truncation_keeps_the_whole_lines(cut in 0.0..1.0_f64) {
        let content = r#"{"timestamp": 1.0, "detections": [{"label": "a", "score": 0.5, "bbox": [0, 0, 1, 1]}]}
{"timestamp": 2.0, "detections": [{"label": "b", "score": 0.5, "bbox": [0, 0, 1, 1]}]}
{"timestamp": 3.0, "detections": [{"label": "c", "score": 0.5, "bbox": [0, 0, 1, 1]}]}"#;
        let cut = (cut * content.len() as f64) as usize;
        let detections = open(&content[..cut]);
        let mut end = 0;
        for (line, t) in content.lines().zip([1.0, 2.0, 3.0]) {
            let begin = end;
            end += line.len() + 1;
            if end - 1 <= cut {
                prop_assert_eq!(detections.at(t).unwrap().unwrap().len(), 1);
            } else if begin < cut {
                prop_assert!(detections.at(t).is_err());
            } else {
                prop_assert!(!matches!(detections.at(t), Ok(Some(_))));
            }
        }
    }

    #[test]
    fn no_file_makes_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), t in any::<f64>()) {
        let detections = open(bytes);
        let _ = detections.at(t);
        let _ = detections.faults();
    }
}
